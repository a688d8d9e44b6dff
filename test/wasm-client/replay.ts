// A transport that answers with what a real service once sent. Source: test/golden/transcripts (see their README).
import { readFileSync } from "node:fs";
import type { OpenTransport, TransportListener } from "../../wasm-client/dist/node.js";

interface Step {
  dir: "c>s" | "s>c";
  hex?: string;
  // eslint-disable-next-line @typescript-eslint/naming-convention -- of the record
  payload_hex?: string;
  http?: string;
  decoded?: string;
}

/** Of the client that was recorded. */
const recordedNodeId = Buffer.from("aaaaaaaabbbbccccddddeeeeeeeeeeee", "hex");

/**
 * Plays the service's part: whenever the client has sent as many messages as the record says, the answers follow.
 * Node id and endpoint of the client are random, so they are exchanged in both directions.
 */
export class Replay {
  /** The client's messages as they were recorded, and as they came, with the recorded ids put in. */
  readonly expected: Buffer[] = [];
  readonly found: Buffer[] = [];
  readonly open: OpenTransport;
  #steps: { dir: string; bytes: Buffer; text: string }[];
  #listener: TransportListener | undefined;
  #received = Buffer.alloc(0);
  #nodeId: Buffer | undefined;
  #endpoint: Buffer | undefined;
  readonly #recordedEndpoint: Buffer;

  constructor(name: string) {
    const file = new URL(`../golden/transcripts/${name}.json`, import.meta.url);
    const { steps } = JSON.parse(readFileSync(file, "utf8")) as { steps: Step[] };
    this.#steps = steps
      .filter((step) => step.hex && !step.http)
      .map((step) => ({
        dir: step.dir,
        bytes: Buffer.from(step.payload_hex ?? step.hex!, "hex"),
        text: step.decoded ?? "",
      }));
    const connecting = this.#steps.find(({ text }) => /ep \d+>0 \| (ConnectClientCombined|GetServiceDesc)/.test(text))!;
    this.#recordedEndpoint = u32(Number(/ep (\d+)>0/.exec(connecting.text)![1]));
    this.open = (_url, listener) => {
      this.#listener = listener;
      queueMicrotask(() => listener.opened());
      return { send: (bytes) => this.#receive(Buffer.from(bytes)), buffered: 0, close: () => undefined };
    };
  }

  /** Whether everything that was recorded has been played. */
  get isOver(): boolean {
    return this.#steps.length === 0;
  }

  #receive(bytes: Buffer): void {
    this.#received = Buffer.concat([this.#received, bytes]);
    for (;;) {
      if (this.#received.length < 8) return;
      const size = this.#received.readUInt32LE(4);
      if (this.#received.length < size) return;
      const message = Buffer.from(this.#received.subarray(0, size));
      this.#received = Buffer.from(this.#received.subarray(size));
      this.#take(message);
    }
  }

  #take(message: Buffer): void {
    // Version 2: the sender's node id follows sizes and version; later messages name the endpoint.
    this.#nodeId ??= Buffer.from(message.subarray(12, 28));
    const step = this.#steps.shift();
    if (step?.dir !== "c>s") throw new Error(`the client sent a message where ${step ? step.text : "nothing"} follows`);
    const isBeforeSession = / ep \d+>0 /.test(step.text);
    if (!this.#endpoint && / ep \d+>0 \| (ConnectClientCombined|GetServiceDesc)/.test(step.text)) {
      this.#endpoint = senderEndpoint(message);
    }
    const found = this.#exchange(message, false);
    // Before there is a session the reference leaves out which node it speaks to; this client has learnt it.
    this.expected.push(isBeforeSession ? withoutHeader(step.bytes) : step.bytes);
    this.found.push(isBeforeSession ? withoutHeader(found) : found);
    queueMicrotask(() => this.#play());
  }

  #play(): void {
    while (this.#steps[0]?.dir === "s>c") {
      this.#listener!.received(this.#exchange(this.#steps.shift()!.bytes, true));
    }
  }

  #exchange(bytes: Buffer, toOurs: boolean): Buffer {
    const copy = Buffer.from(bytes);
    replace(copy, toOurs ? recordedNodeId : this.#nodeId, toOurs ? this.#nodeId : recordedNodeId);
    replace(copy, toOurs ? this.#recordedEndpoint : this.#endpoint, toOurs ? this.#endpoint : this.#recordedEndpoint);
    return copy;
  }
}

/** The message behind its header. */
function withoutHeader(bytes: Buffer): Buffer {
  const isVersion2 = bytes.readUInt16LE(8) === 2;
  return bytes.subarray(isVersion2 ? bytes.readUInt16LE(10) : bytes.readUInt8(10));
}

/** Of a message with all routing fields (messages spec sections 3 and 4). */
function senderEndpoint(bytes: Buffer): Buffer {
  if (bytes.readUInt16LE(8) === 2) return Buffer.from(bytes.subarray(44, 48));
  let at = 12 + 32; // sizes, version, flags; both node ids
  for (let name = 0; name < 2; ++name) at += 1 + bytes.readUInt8(at);
  const first = bytes.readUInt8(at);
  if (first < 0xfd) return u32(first);
  return first === 0xfd ? u32(bytes.readUInt16LE(at + 1)) : Buffer.from(bytes.subarray(at + 1, at + 5));
}

function u32(value: number): Buffer {
  const bytes = Buffer.alloc(4);
  bytes.writeUInt32LE(value);
  return bytes;
}

function replace(bytes: Buffer, from: Buffer | undefined, to: Buffer | undefined): void {
  if (!from || !to) return;
  for (let at = bytes.indexOf(from); at >= 0; at = bytes.indexOf(from, at + 1)) to.copy(bytes, at);
}
