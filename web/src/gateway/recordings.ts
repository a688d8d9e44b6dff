// Recordings that the gateway makes of its devices: which there are, and beginning, stopping, playing and deleting them.
// Layer: web/gateway. Source: /api/v1/recordings. An older gateway answers 404.

import { Store } from "../app/store";
import { isRecord, text } from "./fields";
import { Poller, reasonOf } from "./poller";
import { expectOk, problemOf } from "./answer";
import type { Session } from "./session";

export interface RecordingFile {
  name: string;
  bytes: number;
}

export interface Recording {
  name: string;
  device: string;
  service: string;
  /** "recording", "waiting", "ended" or "failed". */
  state: string;
  /** The gateway's configuration wants it: it can't be stopped here. */
  standing: boolean;
  /** "": none. */
  problem: string;
  beginMs: number;
  seconds: number;
  bytes: number;
  files: readonly RecordingFile[];
  /** The device that plays it, or one of its files; "": none. */
  replay: string;
}

export interface Recordings {
  /** Whether the gateway records at all. */
  enabled: boolean;
  bytes: number;
  maxBytes: number;
  list: readonly Recording[];
}

/** That the gateway plays at a time. */
export const MOST_REPLAYS = 4;

const PATH = "api/v1/recordings";
const POLL_MS = 2_000;

/** Where the browser gets a file from. */
export function fileAddress(file: RecordingFile): string {
  return `${PATH}/${encodeURIComponent(file.name)}`;
}

export function isUnderWay({ state }: Recording): boolean {
  return state === "recording" || state === "waiting";
}

export class RecordingDesk {
  /** null: not known yet. */
  readonly state = new Store<Recordings | null>(null);
  readonly trouble = new Store<string | null>(null);
  readonly #session: Pick<Session, "fetch">;
  readonly #poller: Poller<Recordings>;
  #isAway = false;

  constructor(session: Pick<Session, "fetch">) {
    this.#session = session;
    this.#poller = new Poller({
      ask: (signal) => this.#ask(signal),
      answered: (answer) => {
        this.state.value = answer;
        if (this.#isAway) this.trouble.value = null;
        this.#isAway = false;
      },
      failed: (error) => {
        this.#isAway = true;
        this.trouble.value = reasonOf(error);
      },
      period: POLL_MS,
      hiddenPeriod: null,
    });
  }

  /** Follows the list, while somebody looks. */
  start(): void {
    this.#poller.start();
  }

  stop(): void {
    this.#poller.stop();
  }

  begin(device: string, service: string): Promise<void> {
    return this.#send(PATH, "POST", { device, service });
  }

  end(recording: Recording): Promise<void> {
    return this.#send(`${PATH}/${encodeURIComponent(recording.name)}/stop`, "POST", {});
  }

  remove(recording: Recording): Promise<void> {
    return this.#send(`${PATH}/${encodeURIComponent(recording.name)}`, "DELETE");
  }

  play(recording: Recording): Promise<void> {
    return this.#send(`${PATH}/${encodeURIComponent(recording.name)}/play`, "POST", {});
  }

  endPlaying(recording: Recording): Promise<void> {
    return this.#send(`${PATH}/${encodeURIComponent(recording.name)}/play`, "DELETE");
  }

  async #ask(signal: AbortSignal): Promise<Recordings> {
    const response = await this.#session.fetch(PATH, { signal });
    if (response.status === 404) return readRecordings({});
    await expectOk(response);
    return readRecordings(await response.json());
  }

  async #send(path: string, method: string, body?: object): Promise<void> {
    try {
      const response = await this.#session.fetch(path, {
        method,
        ...(body && { headers: { ["Content-Type"]: "application/json" }, body: JSON.stringify(body) }),
      });
      this.trouble.value = response.ok ? null : await problemOf(response);
    } catch (error) {
      this.trouble.value = reasonOf(error);
    }
    this.#poller.refresh();
  }
}

export function readRecordings(answer: unknown): Recordings {
  const given = isRecord(answer) ? answer : {};
  const number = (value: unknown): number => (typeof value === "number" ? value : 0);
  const list = (value: unknown): Record<string, unknown>[] => (Array.isArray(value) ? value.filter(isRecord) : []);
  return {
    enabled: given["enabled"] === true,
    bytes: number(given["bytes"]),
    maxBytes: number(given["max_bytes"]),
    list: list(given["recordings"]).map((each) => ({
      name: text(each["name"]),
      device: text(each["device"]),
      service: text(each["service"]),
      state: text(each["state"]),
      standing: each["standing"] === true,
      problem: text(each["problem"]),
      beginMs: number(each["begin"]) * 1000,
      seconds: number(each["seconds"]),
      bytes: number(each["bytes"]),
      files: list(each["files"]).map((file) => ({ name: text(file["name"]), bytes: number(file["bytes"]) })),
      replay: [each, ...list(each["files"])].map(({ replay }) => text(replay)).find((device) => device !== "") ?? "",
    })),
  };
}
