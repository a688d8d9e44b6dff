// Services of a type, among the devices of a gateway. Layer: wasm-client/ts.
import type { Proof } from "./platform.js";

/** A service of a device of a gateway. */
export interface FoundService {
  url: string;
  /** Name of the device at the gateway. */
  device: string;
  service: string;
  /** Of the root object, qualified. */
  type: string;
  /** Types that the root object can be used as, too. */
  implements: string[];
  nodeId: string | null;
  nodeName: string | null;
}

export interface ServiceQuery extends Proof {
  /** Where the gateway is: "https://gateway.example". In a page, relative to it. */
  gateway: string | URL;
  /** Of the root object, or one that it implements; qualified: "experimental.create2.Create". */
  type: string;
  /** Which of them; all. */
  filter?: ((found: FoundService) => boolean) | undefined;
  /** Milliseconds for the gateway's answer; 30,000. */
  timeout?: number | undefined;
}

/**
 * The services that are there now, on devices that are online.
 * @throws RobotRaconteurError ConnectionError: the gateway is not reached, or answers something else; RequestTimeout; the reason
 *         of `signal`.
 */
export async function findServices(query: ServiceQuery, signal?: AbortSignal): Promise<FoundService[]> {
  return (await import("./services/find_services.js")).findServices(query, signal);
}
