// The test client by rrgate-client, in Node.
//
//   node client.mjs URL     reads {"steps": [...]} from standard input, prints {"results": [...]}
import { readFileSync } from "node:fs";
import { carry_out } from "./steps.mjs";

const { steps } = JSON.parse(readFileSync(0, "utf8"));
// No process.exit(): it would cut what is still on its way through the pipe.
console.log(JSON.stringify(await carry_out(process.argv[2], steps)));
