// A phone that is a colour sensor of the room: the mean colour of what its camera sees. Its place is that of the address,
// phone.html?x=4&y=3, in m from a corner of the room.
import { serve } from "./rrgate-client/serve/serve.js";
import { offerSignIn } from "./sign_in.js";

const period = 100; // milliseconds
const definition = await (await fetch("experimental.conference_room.robdef")).text();

const status = document.querySelector("[role=status]");
const white = document.querySelector("input[name=white]");
const video = document.querySelector("video");
const canvas = Object.assign(document.createElement("canvas"), { width: 16, height: 12 });
const picture = canvas.getContext("2d", { willReadFrequently: true });

white.oninput = () => (white.labels[0].querySelector("output").value = white.value);

const button = document.querySelector("button");
button.onclick = async () => {
  button.disabled = true;
  const given = new URLSearchParams(location.search);
  const place = { x: Number(given.get("x") ?? 4), y: Number(given.get("y") ?? 3) };
  try {
    video.srcObject = await navigator.mediaDevices.getUserMedia({ video: { facingMode: "environment" } });
    await video.play();
    const device = await serve({
      url: "./",
      name: given.get("name") ?? "sensors-phone",
      service: "Sensors",
      definition,
      type: "experimental.conference_room.Sensors",
      object: { places: [place], daylight: { red: 0, green: 0, blue: 0 } },
      onChange: (isServed, reason) => (status.textContent = isServed ? "measuring" : `no sensor: ${reason}`),
    });
    setInterval(() => device.root.setWire("readings", [measure()]), period);
  } catch (error) {
    status.textContent = `no sensor: ${error.message}`;
    button.disabled = false;
    await offerSignIn(document.querySelector("form"), () => button.click());
  }
};

/** The mean of all points, in lx. */
function measure() {
  picture.drawImage(video, 0, 0, canvas.width, canvas.height);
  const { data } = picture.getImageData(0, 0, canvas.width, canvas.height);
  const sum = [0, 0, 0];
  for (let i = 0; i < data.length; i++) if (i % 4 < 3) sum[i % 4] += data[i];
  const [red, green, blue] = sum.map((each) => ((each * 4) / data.length / 255) * Number(white.value));
  return { red, green, blue };
}
