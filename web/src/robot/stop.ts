// Stops a device at once, past whatever waits, and once more behind the commands that the stop may have overtaken.
// Layer: web/robot.

import { isUnanswered, stopNow, tellStop } from "./control";
import type { Remote } from "./remote";

/** What stops the device: a function with its arguments, and a property to set as well: some drivers have only one of them. */
export interface StopCall {
  call: string;
  args: readonly number[];
  set?: { property: string; value: number };
}

/** Of `com.robotraconteur.robotics.robot.Robot`. */
export const ROBOT_STOP: StopCall = { call: "halt", args: [], set: { property: "command_mode", value: 0 } };

type Device = Pick<Remote, "lease" | "locks" | "path" | "controls" | "urgent" | "setNow" | "underWay">;

const TIMEOUT_MS = 2_000;
const REPEAT_MS = 400;
const REPEATS = 5;

/**
 * Whatever is held down drives no more. Commands that are under way now may arrive after the stop, so it is sent again: when
 * it is answered, for two seconds, and when they have ended.
 * `failed`  hears of a repetition that failed.
 * @throws (rejects) why it did not arrive.
 */
export async function stopDevice(device: Device, stop: StopCall, failed: (error: unknown) => void): Promise<void> {
  const overtaken = device.underWay.settled();
  tellStop();
  const first = send(device, stop, true);
  if (overtaken) sendBehind(device, stop, overtaken, first).catch(failed);
  return first;
}

/**
 * `stop` by the connection; where nothing comes back over that, `without`, which hears why.
 * @returns how `without` went, in words.
 */
export function passOn(stop: Promise<void>, without: (cause: unknown) => Promise<string>): Promise<string | void> {
  return stop.catch((error: unknown) => (isUnanswered(error) ? without(error) : Promise.reject(error)));
}

/** Nothing is waited for: a call that hangs does not hold this one up. */
function send(device: Device, stop: StopCall, insists: boolean): Promise<void> {
  return stopNow(device, insists, () => {
    const ways = [device.urgent(stop.call, stop.args, { timeout: TIMEOUT_MS })];
    if (stop.set) ways.push(device.setNow(stop.set.property, stop.set.value, { timeout: TIMEOUT_MS }));
    return firstToArrive(ways);
  });
}

async function sendBehind(device: Device, stop: StopCall, overtaken: Promise<unknown>, first: Promise<void>) {
  let hasEnded = false;
  const end = overtaken.then(() => void (hasEnded = true));
  await Promise.race([end, first.catch(() => undefined)]); // who asked for the stop hears of the first
  for (let sent = 0; ; sent++) {
    const isLast = hasEnded;
    await send(device, stop, false);
    if (isLast) return;
    await (sent < REPEATS ? Promise.race([end, pause(REPEAT_MS)]) : end);
  }
}

/** @throws (rejects) why the first way failed, where all did. */
async function firstToArrive(ways: readonly Promise<unknown>[]): Promise<void> {
  try {
    await Promise.any(ways);
  } catch (error) {
    throw (error as AggregateError).errors[0];
  }
}

function pause(ms: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
