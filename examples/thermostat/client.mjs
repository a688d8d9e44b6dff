// Warms a room up, in Node: node client.mjs URL
import { connect } from "rrgate-client";

const room = await connect(process.argv[2]);
const reached = room.reached.once({ timeout: 30_000 });
await room.target.set(21);
await reached;
const { celsius } = await room.reading.peek();
console.log(`${celsius} degrees`);
await room.$.close();
