// A client of a wire and a pipe that tells what the service says became of their values.
//
//   node losses.mjs URL     prints {"connected"}; at each line on standard input: ends where it is "end", else tells
//                           {"wire", "pipe": losses, or null where the service keeps none}
import { createInterface } from "node:readline";
import { connect } from "../../../wasm-client/dist/node.js";

const root = await connect(process.argv[2]);
const wire = root.state.connect();
await wire.ready;
const pipe = await root.greetings.connect();
console.log(JSON.stringify({ connected: true }));
for await (const line of createInterface({ input: process.stdin })) {
  if (line.includes("end")) break;
  console.log(JSON.stringify({ wire: (await wire.losses()) ?? null, pipe: (await pipe.losses()) ?? null }));
}
await root.$.close();
