// A line to a device on which what the device says can be held back: it hears, and is not heard.
import { connect, createServer } from "node:net";
import type { AddressInfo, Server, Socket } from "node:net";

export class Line {
  readonly url: string;
  readonly #server: Server;
  readonly #ends: { client: Socket; device: Socket }[] = [];
  #isMuted = false;

  private constructor(server: Server, deviceUrl: URL) {
    this.#server = server;
    const { port } = server.address() as AddressInfo;
    this.url = deviceUrl.href.replace(deviceUrl.host, `127.0.0.1:${port}`);
    server.on("connection", (client) => {
      const device = connect(Number(deviceUrl.port), deviceUrl.hostname);
      this.#ends.push({ client, device });
      client.pipe(device);
      if (!this.#isMuted) device.pipe(client);
      for (const [end, other] of [
        [client, device],
        [device, client],
      ] as const) {
        end.on("error", () => other.destroy());
        end.on("close", () => other.destroy());
      }
    });
  }

  static async to(deviceUrl: string): Promise<Line> {
    const server = createServer();
    await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
    return new Line(server, new URL(deviceUrl));
  }

  mute(): void {
    this.#isMuted = true;
    for (const { client, device } of this.#ends) device.unpipe(client);
  }

  unmute(): void {
    this.#isMuted = false;
    for (const { client, device } of this.#ends) device.pipe(client);
  }

  close(): void {
    this.#server.close();
    for (const { client } of this.#ends) client.destroy();
  }
}
