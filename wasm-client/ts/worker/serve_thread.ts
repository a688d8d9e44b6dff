// What a worker does for its page. Layer: wasm-client/ts/worker.
import { errorFields } from "../errors.js";
import { init, preload } from "../wasm_module.js";
import type { WasmSource } from "../wasm_module.js";
import { Host } from "./host.js";
import type { OpenHosted } from "./host.js";
import type { FromHost, ToThread } from "./messages.js";

/** The global object of a worker. */
export interface ThreadScope {
  addEventListener(type: "message", heard: (event: { data: ToThread }) => void): void;
}

export function serveThread(scope: ThreadScope, open: OpenHosted): void {
  scope.addEventListener("message", ({ data }) => {
    switch (data.kind) {
      case "start":
        if (data.wasm !== undefined) init({ wasm: data.wasm as WasmSource });
        answer(data.port, { kind: "done" });
        break;
      case "preload":
        void load(data.port);
        break;
      case "open":
        void new Host(data.port, open).open(data.url, data.proof);
        break;
    }
  });
}

async function load(port: MessagePort): Promise<void> {
  const loaded: Promise<FromHost> = preload().then(
    () => ({ kind: "done" }),
    (error: unknown) => ({ kind: "refused", error: errorFields(error) }),
  );
  answer(port, await loaded);
}

function answer(port: MessagePort, message: FromHost): void {
  port.postMessage(message);
  port.close();
}
