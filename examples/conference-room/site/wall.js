// The page at the wall of the room: sliders for its light, a plan, and what the sensors have measured in the last minute.
import { subscribe } from "./rrgate-client/index.js";

const colours = ["red", "green", "blue"];
const seconds = 60;
const metres = { x: 8, y: 6 }; // of the floor

const form = document.querySelector("form");
const status = document.querySelector("[role=status]");
const address = (device, service) => {
  const url = new URL(`devices/${device}?service=${service}`, document.baseURI);
  url.protocol = url.protocol.replace("http", "ws");
  return url.href;
};

const controller = subscribe(address("controller", "Controller"));
const lights = subscribe(address("lights", "Lights"));
const groups = ["sensors-north", "sensors-south"].map((name) => subscribe(address(name, "Sensors")));

// --- sliders -------------------------------------------------------------------------------------------------------

const show = (target) => {
  for (const colour of colours) {
    form.elements[colour].value = target[colour];
    form.elements[colour].labels[0].querySelector("output").value = Math.round(target[colour]);
  }
};
controller.onConnected(async (object) => {
  show(await object.target.get());
  form.elements.on.checked = await object.on.get();
  status.textContent = "connected";
});
controller.onLost((reason) => (status.textContent = `the controller is away: ${reason.message}`));

form.oninput = async ({ target: input }) => {
  const object = controller.defaultClient;
  try {
    if (input.name === "on") return await object.on.set(input.checked);
    const target = Object.fromEntries(colours.map((colour) => [colour, form.elements[colour].valueAsNumber]));
    show(target);
    await object.target.set(target);
  } catch (error) {
    status.textContent = object ? error.message : "the controller is away";
  }
};

// --- plots ---------------------------------------------------------------------------------------------------------

/** Draws lines of `[time, value]`, the newest at the right. */
function plot(canvas, lines) {
  const context = canvas.getContext("2d");
  const { width, height } = canvas;
  const now = Date.now();
  const top = Math.max(1, ...lines.flatMap(({ points }) => points.map(([, value]) => value))) * 1.1;
  context.clearRect(0, 0, width, height);
  context.fillStyle = "#888";
  context.fillText(`${Math.round(top)} lx`, 4, 12);
  for (const { colour, points } of lines) {
    while (points.length > 0 && now - points[0][0] > seconds * 1000) points.shift();
    context.strokeStyle = colour;
    context.beginPath();
    for (const [time, value] of points)
      context.lineTo(width * (1 - (now - time) / (seconds * 1000)), height * (1 - value / top));
    context.stroke();
  }
}

const means = colours.map((colour) => ({ colour: colour === "blue" ? "#59f" : colour, points: [] }));
const errors = [{ colour: "white", points: [] }];

async function followMean() {
  for await (const mean of controller.wire("mean")) {
    for (const [i, colour] of colours.entries()) means[i].points.push([Date.now(), mean[colour]]);
    plot(document.querySelector("#mean"), means);
  }
}

async function followError() {
  for await (const error of controller.wire("error")) {
    errors[0].points.push([Date.now(), error]);
    plot(document.querySelector("#error"), errors);
  }
}

// --- plan ----------------------------------------------------------------------------------------------------------

const plan = document.querySelector("#plan");
const paint = plan.getContext("2d");

/** Lights are squares, sensors circles; a level of 1 and 1000 lx are as bright as can be. */
async function followPlaces(device, wire, brightest, draw) {
  let places = [];
  device.onConnected(async (object) => (places = await object.places.get()));
  for await (const values of device.wire(wire)) {
    for (const [i, { x, y }] of places.entries()) {
      if (!values[i]) continue;
      const part = (colour) => Math.round(Math.min(1, values[i][colour] / brightest) * 255);
      paint.fillStyle = `rgb(${colours.map(part).join(" ")})`;
      paint.strokeStyle = "#888";
      paint.beginPath();
      draw((x / metres.x) * plan.width, (y / metres.y) * plan.height);
      paint.fill();
      paint.stroke();
    }
  }
}

await Promise.all([
  followMean(),
  followError(),
  followPlaces(lights, "shown", 1, (x, y) => paint.rect(x - 16, y - 16, 32, 32)),
  ...groups.map((group) => followPlaces(group, "readings", 1000, (x, y) => paint.arc(x, y, 10, 0, 2 * Math.PI))),
]);
