// A line to a device on which what the device says can be held back: it hears, and is not heard.
import { connect, createServer } from "node:net";
import type { AddressInfo, Server, Socket } from "node:net";

export class Line {
  readonly url: string;
  readonly #server: Server;
  readonly #ends: { client: Socket; device: Socket }[] = [];
  #is_muted = false;

  private constructor(server: Server, device_url: URL) {
    this.#server = server;
    const { port } = server.address() as AddressInfo;
    this.url = device_url.href.replace(device_url.host, `127.0.0.1:${port}`);
    server.on("connection", (client) => {
      const device = connect(Number(device_url.port), device_url.hostname);
      this.#ends.push({ client, device });
      client.pipe(device);
      if (!this.#is_muted) device.pipe(client);
      for (const [end, other] of [[client, device], [device, client]] as const) {
        end.on("error", () => other.destroy());
        end.on("close", () => other.destroy());
      }
    });
  }

  static async to(device_url: string): Promise<Line> {
    const server = createServer();
    await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
    return new Line(server, new URL(device_url));
  }

  mute(): void {
    this.#is_muted = true;
    for (const { client, device } of this.#ends) device.unpipe(client);
  }

  unmute(): void {
    this.#is_muted = false;
    for (const { client, device } of this.#ends) device.pipe(client);
  }

  close(): void {
    this.#server.close();
    for (const { client } of this.#ends) client.destroy();
  }
}
