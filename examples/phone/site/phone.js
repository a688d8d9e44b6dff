// A phone as a Robot Raconteur device: what it feels, sees and is touched by.
import { serve } from "./rrgate-client/serve/serve.js";
import { offerSignIn } from "./sign_in.js";

const definition = `
service example.phone
stdver 0.10

struct Picture
    field uint32 width
    field uint32 height
    field string encoding
    field uint8[] data
end

object Phone
    property string text
    property double rate
    function void vibrate(uint32 milliseconds)
    event touched(double x, double y)
    # Metres per second squared, with gravity; degrees.
    wire double[3] acceleration [readonly]
    wire double[3] orientation [readonly]
    pipe Picture frames [readonly]
end`;

const output = document.querySelector("output");
const status = document.querySelector("[role=status]");
const quote = document.querySelector("q");
const video = document.querySelector("video");
const canvas = document.createElement("canvas");

const phone = {
  get text() {
    return quote.textContent;
  },
  set text(text) {
    quote.textContent = text;
  },
  rate: 10, // pictures a second
  vibrate: (milliseconds) => navigator.vibrate?.(milliseconds),
};

const button = document.querySelector("button");
button.onclick = async () => {
  button.disabled = true;
  await globalThis.DeviceMotionEvent?.requestPermission?.(); // of iOS, which asks where a button was pressed
  const name = new URLSearchParams(location.search).get("name") ?? "phone";
  const show = (isServed, reason) => (output.textContent = isServed ? `device "${name}"` : `no device: ${reason}`);
  try {
    const device = await serve({
      url: "./",
      name,
      definition,
      type: "example.phone.Phone",
      object: phone,
      onChange: show,
    });
    feel(device);
    watch(device).catch((error) => (status.textContent = `It has no camera: ${error.message}`));
  } catch (error) {
    show(false, error.message);
    button.disabled = false;
    await offerSignIn(document.querySelector("form"), () => button.click());
  }
};

function feel({ root }) {
  addEventListener("devicemotion", ({ accelerationIncludingGravity: { x, y, z } }) => {
    if (x !== null) root.setWire("acceleration", [x, y, z]);
  });
  addEventListener("deviceorientation", ({ alpha, beta, gamma }) => {
    if (alpha !== null) root.setWire("orientation", [alpha, beta, gamma]);
  });
  addEventListener("pointerdown", ({ clientX, clientY }) => {
    root.emit("touched", clientX / innerWidth, clientY / innerHeight);
  });
}

/** Sends pictures as fast as the slowest client takes them, at most. */
async function watch({ root }) {
  video.srcObject = await navigator.mediaDevices.getUserMedia({ video: { facingMode: "environment" } });
  await video.play();
  const frames = root.pipe("frames");
  for (;;) {
    await new Promise((resolve) => setTimeout(resolve, 1000 / phone.rate));
    if (frames.endpoints.size === 0) continue;
    const { videoWidth: width, videoHeight: height } = video;
    Object.assign(canvas, { width, height }).getContext("2d").drawImage(video, 0, 0);
    const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/jpeg", 0.7));
    await frames.send({ width, height, encoding: "jpeg", data: new Uint8Array(await blob.arrayBuffer()) });
  }
}
