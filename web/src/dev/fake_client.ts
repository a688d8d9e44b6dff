// DEVELOPMENT ONLY: a robot and cameras without a gateway, of the same shape as rrgate-client.
export class RobotRaconteurError extends Error {
  code = 0; subName = ""; param: unknown = null;
  constructor(name: string, message: string) { super(message); this.name = name; }
}
const world = { x: 0.6, y: 0.5, th: 0.4, v: 0, r: 32767, dist: 1234, ang: 12, bump: 0 };
const W: number[] = [-2,-1.5,2.5,-1.5, 2.5,-1.5,2.5,1.5, 2.5,1.5,-2,1.5, -2,1.5,-2,-1.5, 1.1,-0.6,1.6,-0.6, 1.6,-0.6,1.6,-0.1, 1.6,-0.1,1.1,-0.1, 1.1,-0.1,1.1,-0.6, -1.2,0.3,-0.6,0.9];
const bump_subs = new Set<() => void>();
const sleep = (ms: number) => new Promise((r) => setTimeout(r, ms));
setInterval(() => {
  const dt = 0.02; let w = 0, v = world.v / 1000;
  if (world.r === 1 || world.r === -1) { w = (v / 0.13) * world.r; v = 0; } else if (Math.abs(world.r) < 32767) w = v / (world.r / 1000);
  const nx = world.x + v * dt * Math.cos(world.th), ny = world.y + v * dt * Math.sin(world.th);
  const hit = nx < -1.83 || nx > 2.33 || ny < -1.33 || ny > 1.33 || (nx > 0.93 && nx < 1.77 && ny > -0.77 && ny < 0.07);
  if (hit) { if (!world.bump) { world.bump = 3; for (const f of bump_subs) f(); } }
  else { world.bump = 0; world.x = nx; world.y = ny; world.dist += v * dt * 1000; }
  world.th += w * dt; world.ang += w * dt * 57.29578;
}, 20);
const listof = (a: number[]) => { const r: object[] = []; for (let i = 0; i < a.length; i += 4) r.push({ x1: a[i], y1: a[i+1], x2: a[i+2], y2: a[i+3], height: 0.5 }); return r; };
const m = (kind: string, type: string, name: string, parameters: unknown[] = [], modifiers: string[] = []) => ({ kind, type, name, parameters, modifiers, documentation: name === "Drive" ? "Drives on an arc until the next call. Velocity in mm/s, -500 to 500, negative is backwards." : "" });
const connections = new Set<{ cut(): void }>();
let down = false;
(globalThis as any).fake = { cut() { down = true; for (const c of [...connections]) c.cut(); }, mend() { down = false; }, world, get down() { return down; } };
const down_now = () => down;
function make(type: string, members: any[], impl: Record<string, unknown>) {
  const closers: ((e?: unknown) => void)[] = [];
  const con = { open: true, cut() { this.open = false; connections.delete(this); for (const f of closers) f(new RobotRaconteurError("ConnectionLost", "the gateway closed the relay: device create is down (connection refused)")); } };
  connections.add(con);
  return { con, $: { state: "open", type, members, onClose: (f: any) => closers.push(f), async close() { con.open = false; connections.delete(con); }, stats: {}, member: (n: string) => (impl as any)[n] }, ...impl };
}
export async function connect(url: string): Promise<unknown> {
  await sleep(250);
  if (down_now()) throw new RobotRaconteurError("ConnectionError", "device create is down: connection refused");
  const mk_wire = (get: () => unknown, con: () => { open: boolean }) => ({ async *connect() { while (con().open) { await sleep(50); yield get(); } }, peek: async () => get(), poke: async () => { throw new RobotRaconteurError("ReadOnlyMember", "wire is readonly"); } });
  if (url.includes("Webcam")) {
    const cam: any = { $: { type: "experimental.createwebcam2.Webcam", members: [m("property", "string", "Name", [], ["readonly"]), m("function", "experimental.createwebcam2.WebcamImage", "CaptureFrame"), m("pipe", "experimental.createwebcam2.WebcamImage", "FrameStream", [], ["readonly"]), m("memory", "uint8[]", "buffer", [], ["readonly"])], onClose() {}, async close() {}, member: (n: string) => (cam as any)[n] },
      Name: { get: async () => "front camera" },
      CaptureFrame: async () => { const w = 320, h = 240, d = new Uint8Array(w * h * 3); for (let y = 0; y < h; y++) for (let x = 0; x < w; x++) { const o = (y * w + x) * 3; const sky = y < 110 + 20 * Math.sin(x / 60 + world.th * 2); d[o] = sky ? 220 - y / 2 : 120; d[o + 1] = sky ? 190 : 150 + ((x >> 4) + (y >> 4)) % 2 * 20; d[o + 2] = sky ? 150 : 165; } return { width: w, height: h, step: w * 3, data: d }; } };
    return make("experimental.createwebcam2.WebcamHost", [m("property", "string{int32}", "WebcamNames", [], ["readonly"]), m("objref", "experimental.createwebcam2.Webcam{int32}", "Webcams")], { WebcamNames: { get: async () => new Map([[0, "front camera"], [1, "rear camera"]]) }, Webcams: { get: async () => cam } });
  }
  let self: any;
  const con = () => self.con;
  const state = new URL(url).searchParams.get("service") === "Create" ;
  self = make("experimental.simulatedcreate.SimulatedCreate", [
    m("function", "void", "Drive", [{ name: "velocity", type: "int16" }, { name: "radius", type: "int16" }]), m("function", "void", "StartStreaming"), m("function", "void", "StopStreaming"),
    m("function", "double[]", "Scale", [{ name: "values", type: "double[]" }, { name: "by", type: "double" }, { name: "invert", type: "bool" }, { name: "options", type: "experimental.create2.Options" }]),
    m("property", "int32", "DistanceTraveled", [], ["readonly"]), m("property", "int32", "AngleTraveled", [], ["readonly"]), m("property", "uint8", "Bumpers", [], ["readonly"]), m("property", "string", "Label"), m("property", "Wall{list}", "walls", [], ["readonly"]), m("property", "Obstacle{list}", "obstacles", [], ["readonly"]), m("function", "void", "reset"),
    m("event", "", "Bump"), m("wire", "experimental.create2.SensorPacket", "packets", [], ["readonly"]), ...(state ? [m("wire", "experimental.create2.State", "state", [], ["readonly"])] : []), m("callback", "uint8[]", "play_callback", [{ name: "DistanceTraveled", type: "int32" }]),
  ], {
    Drive: async (v: number, r: number) => { await sleep(5); world.v = v; world.r = r; }, StartStreaming: async () => {}, StopStreaming: async () => {},
    Scale: async () => { await sleep(30); throw new RobotRaconteurError("experimental.create2.ScaleError", "factor must not be zero"); },
    DistanceTraveled: { get: async () => (await sleep(3), Math.round(world.dist)) }, AngleTraveled: { get: async () => Math.round(world.ang) }, Bumpers: { get: async () => world.bump }, Label: { get: async () => "my robot", set: async () => {} },
    reset: async () => { world.x = 0; world.y = 0; world.th = 0; }, obstacles: { get: async () => [{ x: -1.2, y: -0.8, radius: 0.25, height: 1 }, { x: 0.3, y: 1.2, radius: 0.12 }] }, walls: { get: async () => listof(W) },
    Bump: { on: (f: () => void) => (bump_subs.add(f), () => bump_subs.delete(f)) },
    packets: mk_wire(() => { const b = new DataView(new ArrayBuffer(12)); b.setInt16(8, world.v); b.setInt16(10, world.v); return { ID: 5, Data: new Uint8Array(b.buffer) }; }, con),
    state: mk_wire(() => ({ x: world.x, y: world.y, heading: Math.atan2(Math.sin(world.th), Math.cos(world.th)), velocity: world.v / 1000, turn_rate: 0, bumpers: world.bump }), con),
  });
  return self;
}
export function fake_devices() {
  const create = down ? "offline" : "online";
  return { devices: [
    { name: "create", url: "rr+tcp://127.0.0.1:52222/?service=Create", node_id: "{8c9a5cd3-b5aa-4c4b-a7ee-6f3c0e1d2a10}", node_name: "rrgate.demo.create", state: create, last_error: down ? "connection refused" : null, services: [{ name: "Create", type: "experimental.simulatedcreate.SimulatedCreate" }] },
    { name: "webcams", url: "rr+tcp://127.0.0.1:52224/?service=Webcam", node_id: "{0f}", node_name: "rrgate.demo.webcams", state: "online", last_error: null, services: [{ name: "Webcam", type: "experimental.createwebcam2.WebcamHost" }] },
    { name: "gripper", url: "rr+tcp://10.0.0.17:52300/?service=Gripper", node_id: "", node_name: "", state: "offline", last_error: "connect to 10.0.0.17:52300: connection timed out", services: [] },
    { name: "arm-left", url: "rrs+tcp://10.0.0.18:52310/?service=Robot", node_id: "", node_name: "", state: "connecting", last_error: null, services: [] },
  ] };
}
const mode = new URLSearchParams(location.search).get("fake");
const real = window.fetch;
window.fetch = async (input, init) => {
  if (!String(input).includes("api/v1/devices")) return real(input as any, init);
  await sleep(60);
  if (mode === "loading") await sleep(1e6);
  if ((globalThis as any).gateway_away) throw new TypeError("Failed to fetch");
  return new Response(JSON.stringify(mode === "empty" ? { devices: [] } : fake_devices()));
};
