// How much goes to the network at a time, and when a core is looked at again. Layer: wasm-client/ts.
import type { Transport } from "./transport.js";

/**
 * Above this many bytes in the transport, the core keeps what it has: there newer wire values replace older ones, and
 * urgent requests go ahead. One more frame may be on top of it. With the time below, Chromium sends 28 MB/s by it; with
 * 32 KiB it is 15.
 */
const transmitMark = 64 * 1024;
/** While this many bytes wait for the network, in the transport and in the core, so do senders that ask for room. */
export const roomMark = 256 * 1024;
/** Native peers take WebSocket frames of at most this many bytes. */
export const frameLimit = 65_535;
/** Bytes that go into a core at once; its receive buffer stays as small. */
export const receiveLimit = 1024 * 1024;
/** WebSockets do not say when they have room again. */
const drainPollMs = 4;
/** setTimeout takes little more than this. */
const longestTimerMs = 2e9;

/** Gives the transport what it has room for. `poll`: bytes that stay until `transmitted` is told of them. */
export function transmit(
  transport: Transport,
  poll: () => Uint8Array | undefined,
  transmitted: (size: number) => void,
): void {
  while (transport.buffered < transmitMark) {
    const bytes = poll();
    if (!bytes) return;
    transport.send(bytes);
    transmitted(bytes.length);
  }
}

export interface LookTimer {
  /** Sees to it that there is a look in time. */
  arm(): void;
  stop(): void;
}

/**
 * Calls `look` when the core, or the transport that had no room, is to be looked at again. `pollTimeout` says when the core
 * wants it.
 */
export function lookTimer(transport: Transport, pollTimeout: () => number, look: () => void): LookTimer {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let at = Infinity;
  const stop = () => clearTimeout(timer);
  const arm = () => {
    const now = performance.now();
    const isHeldBack = transport.buffered >= transmitMark;
    const due = isHeldBack ? now + drainPollMs : pollTimeout();
    if (due >= at) return; // the running timer looks again when it fires
    clearTimeout(timer);
    at = due;
    // Rounded up: a timer that fires early would only be set anew. What is past is due at once.
    const delay = Math.min(Math.ceil(due - now), longestTimerMs);
    timer = setTimeout(() => {
      at = Infinity;
      look();
    }, delay);
  };
  return { arm, stop };
}
