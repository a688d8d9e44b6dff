// The worker of a page, and connections by it. Layer: wasm-client/ts/worker.
import { makeError, RobotRaconteurError } from "../errors.js";
import { Once } from "../once.js";
import type { Proof } from "../platform.js";
import type { CoreTransport, OpenTransport } from "../transport.js";
import type { Core, InitOptions } from "../wasm_module.js";
import type { FromHost, ToHost, ToThread } from "./messages.js";
import { copyOf, restore, weigh } from "./passage.js";
import { RemoteCore } from "./remote_core.js";

export interface WorkerInitOptions extends InitOptions {
  /** Makes the worker, where a bundler does not see to it: of `rrgate-client/worker-thread`, as a module. */
  worker?: (() => Worker | Promise<Worker>) | undefined;
}

let options: WorkerInitOptions = {};
const thread = new Once(start, "the worker could not be started");

/**
 * Says where the protocol core and the worker come from. Before the first connect(), subscribe() or preload().
 * @throws RobotRaconteurError InvalidOperation: the worker is there already.
 */
export function init(given: WorkerInitOptions): void {
  if (thread.isBegun) throw makeError("InvalidOperation", "init: the worker is started already; call it first");
  options = given;
}

/**
 * Starts the worker and loads the protocol core there, for connections to come.
 * @throws RobotRaconteurError (rejects) SystemResourceError: a file cannot be loaded; a later call tries again.
 */
export async function preload(): Promise<void> {
  await ask(await thread.get(), (port) => ({ kind: "preload", port }));
}

/** Transports whose socket and core are in the worker. */
export function openInWorker({ token, headers }: Proof): OpenTransport {
  return async (url, listener) => {
    const worker = await thread.get();
    const { port1: port, port2 } = new MessageChannel();
    const say = (message: ToHost, transfer: ArrayBuffer[] = []) => port.postMessage(message, transfer);
    const core = new RemoteCore(say);
    /** Who waits for the next answer. */
    let answer: { resolve(): void; reject(reason: unknown): void };
    const answered = () => new Promise<void>((resolve, reject) => (answer = { resolve, reject }));

    port.onmessage = ({ data }: MessageEvent<FromHost>) => {
      restore(data.marks);
      switch (data.kind) {
        case "refused":
          answer.reject(new RobotRaconteurError(data.error));
          break;
        case "opened":
          listener.opened();
          break;
        case "lost":
          listener.closed(data.reason);
          break;
        case "news":
          core.take(data);
          listener.received(nothing); // the session polls what the core has to tell
          say({ kind: "taken" });
          break;
        default:
          answer.resolve();
      }
    };
    const proof = copyOf({ token, headers }) as Proof;
    worker.postMessage({ kind: "open", url: url.href, proof, port: port2 } satisfies ToThread, [port2]);
    await answered();
    return {
      send: () => undefined,
      buffered: 0,
      close: () => {
        say({ kind: "close" });
        port.close();
      },
      createCore: async (given) => {
        const copy = copyOf(given) as typeof given;
        say({ kind: "core", options: copy, marks: weigh(copy).marks });
        await answered();
        return core as unknown as Core;
      },
    } satisfies CoreTransport;
  };
}

const nothing = new Uint8Array(0);

async function start(): Promise<Worker> {
  const { wasm } = options;
  const source: unknown = await (typeof wasm === "function" ? (wasm as () => unknown)() : wasm);
  const worker = await makeWorker();
  const failed = new Promise<never>((_, reject) =>
    worker.addEventListener("error", ({ message }) => reject(new Error(message || "its script cannot be loaded")), {
      once: true,
    }),
  );
  failed.catch(() => undefined); // once it runs, the page hears of its errors as of its own
  // Relative to the page, which the worker does not know.
  const isUrl = typeof source === "string" || source instanceof URL;
  const given = isUrl ? new URL(source, globalThis.location?.href).href : source;
  await Promise.race([failed, ask(worker, (port) => ({ kind: "start", wasm: given, port }))]);
  return worker;
}

function makeWorker(): Worker | Promise<Worker> {
  if (options.worker) return options.worker();
  if (typeof Worker === "undefined") throw new Error("there are no workers here");
  // Written out so that bundlers see it and ship the script.
  return new Worker(new URL("./worker_thread.js", import.meta.url), { type: "module" });
}

/** @throws RobotRaconteurError (rejects) what the worker says. */
function ask(worker: Worker, message: (port: MessagePort) => ToThread): Promise<void> {
  const { port1, port2 } = new MessageChannel();
  return new Promise((resolve, reject) => {
    port1.onmessage = ({ data }: MessageEvent<FromHost>) => {
      port1.close();
      if (data.kind === "refused") reject(new RobotRaconteurError(data.error));
      else resolve();
    };
    worker.postMessage(message(port2), [port2]);
  });
}
