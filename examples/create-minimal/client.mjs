// Drives an iRobot Create for a second, and prints what its sensors say, through a gateway: node client.mjs URL
import { setTimeout as sleep } from "node:timers/promises";
import { connect, lease } from "rrgate-client";

const speed = 100; // mm/s
const straight = 32767; // a radius that stands for none

const create = await connect(process.argv[2]);
const printDistance = async () => console.log(`DistanceTraveled: ${await create.DistanceTraveled.get()} mm`);
let isInterrupted = false;
process.once("SIGINT", () => (isInterrupted = true)); // Ctrl-C ends the drive

await printDistance();
create.Bump.on(() => console.log("bump"));
const packets = create.packets.connect();
await create.StartStreaming();
const held = await lease(create, { deadman: 1000 }); // if this program hangs or dies, the gateway stops the robot
try {
  await create.Drive(speed, straight);
  for (let step = 0; step < 5 && !isInterrupted; ++step) {
    await sleep(200);
    if (packets.value) console.log(`packet ${packets.value.ID}: ${packets.value.Data.join(" ")}`);
  }
} finally {
  await create.Drive(0, straight);
  await create.StopStreaming();
  await held.release();
}
await printDistance();
await create.$.close();
