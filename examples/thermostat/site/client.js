// Warms a room up, in a page.
import { connect } from "./rrgate-client/index.js";

const room = await connect("/devices/room?service=Thermostat");
const output = document.querySelector("output");
document.querySelector("button").onclick = () => room.target.set(21);
for await (const { celsius, heating } of room.reading.connect()) {
  output.textContent = `${celsius} degrees${heating ? ", and warmer soon" : ""}`;
}
