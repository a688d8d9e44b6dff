// What is known of the demo robot: pose, trail, readings and bumps. Outlives connections, so nothing is lost with one.
// Layer: web/robot. Source: experimental.create and create2; what simulatedcreate adds is used when the device has it.

import { Store } from "../app/store";
import { Pace } from "../live/pace";
import { pause } from "../live/pause";
import { Reckoner } from "./reckoning";
import type { Pose } from "./reckoning";
import { explain } from "./remote";
import type { Remote } from "./remote";
import { EMPTY_ROOM, obstaclesOf, poseOf, wallsOf } from "./room";
import type { Room } from "./room";
import { readSensorPacket } from "./sensor_packet";
import { Series } from "./series";
import { Trail } from "./trail";

export interface Bump {
  number: number;
  time: number;
  side: string;
  pose: Pose;
}

export interface Readings {
  distanceMm: number | null;
  angleDeg: number | null;
  bumpers: number | null;
  leftWheelMmS: number | null;
  rightWheelMmS: number | null;
  packet: { id: number; bytes: Uint8Array } | null;
}

/** What the robot tells, piece by piece: each may stop coming while others go on. */
export type Told = keyof Readings | "pose";

const POLL_MS = 100;
const RETRY_MS = 1_000;
const SHOW_MS = 100; // numbers faster than this cannot be read
const MAX_BUMPS = 200;
const NO_READINGS: Readings = {
  distanceMm: null,
  angleDeg: null,
  bumpers: null,
  leftWheelMmS: null,
  rightWheelMmS: null,
  packet: null,
};

export class RobotModel {
  pose: Pose = { x: 0, y: 0, theta: 0 };
  /** Whether the device tells its pose itself; else it is reckoned from distance and angle. */
  readonly poseSource = new Store<"device" | "reckoned">("reckoned");
  readonly trail = new Trail();
  readonly room = new Store<Room>(EMPTY_ROOM);
  radiusM = 0.165;
  readonly readings = new Store<Readings>(NO_READINGS);
  readonly bumps = new Store<readonly Bump[]>([]);
  readonly series = {
    distance: new Series(),
    angle: new Series(),
    leftWheel: new Series(),
    rightWheel: new Series(),
  };
  readonly packetPace = new Pace();
  /** What fails while reading, shown beside the values; null when all is well. */
  readonly trouble = new Store<string | null>(null);

  readonly #isRecorded: boolean;
  readonly #reckoner = new Reckoner();
  readonly #moved = new Set<() => void>();
  readonly #heard = new Map<Told, number>();
  readonly #troubles = new Map<string, string>();
  #latest: Readings = NO_READINGS;
  #showTimer: ReturnType<typeof setTimeout> | undefined;
  #bumpCount = 0;

  /** `isRecorded`  plays what a robot has sent: it can't be called. */
  constructor({ isRecorded = false } = {}) {
    this.#isRecorded = isRecorded;
  }

  /** Runs `moved` whenever the map needs a new picture. */
  onMoved(moved: () => void): () => void {
    this.#moved.add(moved);
    return () => void this.#moved.delete(moved);
  }

  /** When the robot last told of it, by performance.now(); null when it never did. */
  heardAt(what: Told): number | null {
    return this.#heard.get(what) ?? null;
  }

  /** Follows a connected robot until `signal` aborts. */
  attach(remote: Remote, signal: AbortSignal): void {
    this.#troubles.clear();
    this.trouble.value = null;
    this.#reckoner.rebase();
    void this.#keep("reading the room", signal, () => this.#readRoom(remote));
    const hasState = remote.has("state", "wire");
    this.poseSource.value = hasState ? "device" : "reckoned";
    if (hasState) void this.#keep("wire state", signal, () => this.#followState(remote, signal));
    void this.#keep("reading values", signal, () => this.#poll(remote, signal));
    if (remote.has("packets", "wire"))
      void this.#keep("wire packets", signal, () => this.#followPackets(remote, signal));
    if (remote.has("Bump", "event")) this.#followBumps(remote, signal);
  }

  clearTrail(): void {
    this.trail.clear();
    this.bumps.value = [];
    this.#redraw();
  }

  /** Until `work` is done: where it fails, that is shown, and it begins anew a second later. */
  async #keep(what: string, signal: AbortSignal, work: () => Promise<void>): Promise<void> {
    while (!signal.aborted) {
      try {
        return await work();
      } catch (error) {
        if (signal.aborted) return;
        this.#troubles.set(what, explain(error));
        this.#tellTrouble();
      }
      await pause(RETRY_MS, signal);
    }
  }

  #works(what: string): void {
    if (this.#troubles.delete(what)) this.#tellTrouble();
  }

  #tellTrouble(): void {
    const [first] = this.#troubles;
    this.trouble.value = first ? first.join(": ") : null;
  }

  async #readRoom(remote: Remote): Promise<void> {
    const read = async (name: string): Promise<unknown> => (remote.has(name, "property") ? remote.get(name) : null);
    const [walls, obstacles, radius] = await Promise.all([read("walls"), read("obstacles"), read("radius")]);
    this.room.value = { walls: wallsOf(walls), obstacles: obstaclesOf(obstacles) };
    if (typeof radius === "number" && radius > 0) this.radiusM = radius;
    this.#works("reading the room");
    this.#redraw();
  }

  async #followState(remote: Remote, signal: AbortSignal): Promise<void> {
    for await (const value of remote.wire("state", signal)) {
      this.#works("wire state");
      const pose = poseOf(value);
      if (pose) this.#moveTo(pose);
      const { bumpers } = (value ?? {}) as { bumpers?: unknown };
      if (typeof bumpers === "number") this.#show({ bumpers });
    }
    throw new Error("the device closed it");
  }

  /** Each round begins after the one before it is answered. */
  async #poll(remote: Remote, signal: AbortSignal): Promise<void> {
    while (!signal.aborted) {
      await this.#pollOnce(remote, signal);
      this.#works("reading values");
      await pause(POLL_MS, signal);
    }
  }

  async #pollOnce(remote: Remote, signal: AbortSignal): Promise<void> {
    const read = async (name: string): Promise<number | null> =>
      remote.has(name, "property") ? Number(await remote.get(name)) : null;
    const [distanceMm, angleDeg, bumpers] = await Promise.all([
      read("DistanceTraveled"),
      read("AngleTraveled"),
      read("Bumpers"),
    ]);
    if (signal.aborted) return;
    const now = performance.now();
    if (distanceMm !== null) this.series.distance.push(now, distanceMm);
    if (angleDeg !== null) this.series.angle.push(now, angleDeg);
    if (distanceMm !== null && angleDeg !== null && this.poseSource.value === "reckoned") {
      this.#moveTo(this.#reckoner.update(distanceMm, angleDeg));
    }
    this.#show({ distanceMm, angleDeg, ...(bumpers === null ? {} : { bumpers }) });
  }

  async #followPackets(remote: Remote, signal: AbortSignal): Promise<void> {
    // Counted per client on some robots, one switch for all on others: so it is never stopped from here. The count ends
    // with the connection, and a switch is not ours to turn off.
    if (!this.#isRecorded && remote.has("StartStreaming", "function")) await remote.call("StartStreaming", []);
    for await (const value of remote.wire("packets", signal)) {
      this.#works("wire packets");
      this.#takePacket(value);
    }
    throw new Error("the device closed it");
  }

  #takePacket(value: unknown): void {
    const { ID, Data } = (value ?? {}) as { ID?: unknown; Data?: unknown };
    if (typeof ID !== "number" || !(Data instanceof Uint8Array)) return;
    const now = performance.now();
    const { bumpers, leftWheelMmS, rightWheelMmS } = readSensorPacket(ID, Data);
    this.packetPace.hear(now);
    if (leftWheelMmS !== undefined) this.series.leftWheel.push(now, leftWheelMmS);
    if (rightWheelMmS !== undefined) this.series.rightWheel.push(now, rightWheelMmS);
    this.#show({
      packet: { id: ID, bytes: Data },
      ...(bumpers === undefined ? {} : { bumpers }),
      ...(leftWheelMmS === undefined ? {} : { leftWheelMmS }),
      ...(rightWheelMmS === undefined ? {} : { rightWheelMmS }),
    });
  }

  #followBumps(remote: Remote, signal: AbortSignal): void {
    const unsubscribe = remote.on("Bump", () => {
      const time = Date.now();
      // The event has no parameters; the side is in the property, read while the robot still touches.
      const bumpers = remote.has("Bumpers", "property") ? remote.get("Bumpers") : Promise.resolve(0);
      bumpers
        .then(Number)
        .catch(() => 0)
        .then(
          (bits) => this.#logBump(time, bits),
          () => undefined,
        );
    });
    signal.addEventListener("abort", unsubscribe, { once: true });
  }

  #logBump(time: number, bits: number): void {
    const bump: Bump = { number: ++this.#bumpCount, time, side: sideOf(bits), pose: this.pose };
    this.bumps.value = [bump, ...this.bumps.value].slice(0, MAX_BUMPS);
    this.#redraw();
  }

  #moveTo(pose: Pose): void {
    this.#heard.set("pose", performance.now());
    this.pose = pose;
    this.trail.add({ x: pose.x, y: pose.y });
    this.#redraw();
  }

  #show(change: Partial<Readings>): void {
    for (const name of Object.keys(change)) this.#heard.set(name as keyof Readings, performance.now());
    this.#latest = { ...this.#latest, ...change };
    this.#showTimer ??= setTimeout(() => {
      this.#showTimer = undefined;
      this.readings.value = this.#latest;
    }, SHOW_MS);
  }

  #redraw(): void {
    for (const moved of this.#moved) moved();
  }
}

export function sideOf(bits: number): string {
  return ["", "right", "left", "both sides"][bits & 3] ?? "";
}
