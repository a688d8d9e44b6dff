// A subscription over a reload of the proxy between.
//
//   node reload.mjs URL     prints {"connected"}; at each line on standard input: ends where it is "end", else tells
//                           {"losses", "longest": the longest loss so far in ms, "value": what a call brings,
//                            "connects": of each connection so far {"received": bytes, "sent": messages} until it was up,
//                            "definitions": characters of those that the last one knows}
import { createInterface } from "node:readline";
import { subscribe } from "../../../wasm-client/dist/node.js";

const subscription = subscribe(process.argv[2]);
const connects = [];
let losses = 0;
let longest = 0;
let lost = 0;
let definitions = 0;
subscription.onLost(() => {
  losses += 1;
  lost = performance.now();
});
subscription.onConnected((client) => {
  if (lost) longest = Math.max(longest, performance.now() - lost);
  lost = 0;
  const { bytesReceived: received, messagesSent: sent } = client.$.stats;
  connects.push({ received, sent });
  definitions = client.$.types.join("").length;
});
await subscription.client({ timeout: 20_000 });
console.log(JSON.stringify({ connected: true }));
for await (const line of createInterface({ input: process.stdin })) {
  if (line.includes("end")) break;
  const client = await subscription.client({ timeout: 20_000 });
  let value = null;
  try {
    value = await client.add(1, 2);
  } catch {
    value = await (await subscription.client({ timeout: 20_000 })).add(1, 2); // it was lost in between
  }
  console.log(JSON.stringify({ losses, longest, value, connects, definitions }));
}
await subscription.close();
