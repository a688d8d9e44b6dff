// What engines differ in, as pages and workers have it; node.ts puts Node's ways in its place. Layer: wasm-client/ts.
// Relative imports only: a page loads dist/ as it is, without a bundler.
import { makeError, textOf } from "./errors.js";

/** What shows a gateway who one is. */
export interface Proof {
  /** An API token or a JSON Web Token of the gateway. In a page it is exchanged for a ticket before each connection. */
  token?: string | undefined;
  /** Of each request and upgrade. In a page requests alone can carry them: connections refuse. */
  headers?: Readonly<Record<string, string>> | undefined;
}

/** The headers of a request that shows it. */
export const headersOf = ({ token, headers }: Proof): Record<string, string> => ({
  ...(token !== undefined && { ["Authorization"]: `Bearer ${token}` }),
  ...headers,
});

export interface Platform {
  /** Compiles a file of this package. */
  loadWasm(url: URL): Promise<WebAssembly.Module>;
  /**
   * The class whose sockets show `proof`; in a page `url` gets a ticket for it.
   * @throws RobotRaconteurError SystemResourceError: there is none; InvalidArgument: headers in a page; AuthenticationError,
   *         ConnectionError: there is no ticket.
   */
  findWebsocket(url: URL, proof: Proof): Promise<typeof WebSocket>;
}

export const platform: Platform = {
  async loadWasm(url) {
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url.href} answered ${response.status} ${response.statusText}`);
    if (response.headers.get("Content-Type")?.startsWith("application/wasm")) {
      return WebAssembly.compileStreaming(response);
    }
    return WebAssembly.compile(await response.arrayBuffer());
  },

  async findWebsocket(url, proof) {
    if (proof.headers)
      throw makeError(
        "InvalidArgument",
        "headers: a page can't add any to a WebSocket; use token, or a ticket in the URL",
      );
    if (proof.token !== undefined) url.searchParams.set("ticket", await fetchTicket(url, proof));
    return WebSocket;
  },
};

/** Source: POST /api/v1/tickets of the gateway whose devices/NAME `socket` is. */
async function fetchTicket(socket: URL, proof: Proof): Promise<string> {
  const url = new URL("../api/v1/tickets", socket.href.replace(/^ws/, "http"));
  const where = `no ticket of ${url.href}`;
  // Without "omit" a refused token would open the browser's own dialog.
  const request = { method: "POST", headers: headersOf(proof), credentials: "omit", cache: "no-store" } as const;
  const response = await fetch(url, request).catch((error: unknown) => {
    throw makeError("ConnectionError", `${where}: ${textOf(error)}`);
  });
  const { ticket } = (response.ok ? ((await response.json().catch(() => undefined)) ?? {}) : {}) as { ticket?: string };
  if (ticket) return ticket;
  const isRefused = response.status === 401 || response.status === 403;
  throw makeError(isRefused ? "AuthenticationError" : "ConnectionError", `${where}: HTTP ${response.status}`);
}
