// The client as it is published, in three engines: a program that uses every way to a device.
import { cpSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { expect, test } from "@playwright/test";
import { inEachEngine } from "../engines";
import { makeCertificate, repositoryRoot, startTestService } from "../processes";

let service: Awaited<ReturnType<typeof startTestService>>;

/** The client as it is published, an empty page, and a certificate: the gateway's port takes both ws and wss. */
async function startClientSite(): Promise<typeof service> {
  const site = mkdtempSync(path.join(tmpdir(), "rrgate-site-"));
  cpSync(path.join(repositoryRoot, "wasm-client/dist"), site, { recursive: true });
  writeFileSync(path.join(site, "index.html"), "<!doctype html><title>client</title>");
  return startTestService(site, () => ({ tls: { certificates: [makeCertificate()] } }));
}

test.beforeAll(async () => {
  service = await startClientSite();
});

test.afterAll(() => service?.stop());

inEachEngine((at) => {
  for (const [scheme, entry, how, worker] of [
    ["http", "index.js", "ws"],
    ["https", "index.js", "wss"],
    ["http", "worker.js", "ws in a worker"],
    ["https", "worker.js", "wss in a worker"],
    ["http", "index.js", "ws in a worker of connect()", true],
  ] as const) {
    test(`the client calls, reads, listens and sends by ${how}`, async () => {
      const visitor = at();
      await visitor.open(service.url.replace("http", scheme));
      expect(await visitor.run(useAllMembers, entry, worker ?? false)).toEqual({
        called: 5,
        refused: "not today",
        set: "für alle",
        wire: [1, 2, 3],
        event: [0, "number 0"],
        pipe: [2, 4],
        generated: [1, 2, 3],
        memory: 3,
        state: "closed",
      });
    });
  }
});

/** Runs in the page. `entry`: of the client; `worker`: option of connect(). */
async function useAllMembers(entry: string, worker: boolean): Promise<object> {
  const { connect } = await import(new URL(entry, location.href).href);
  const device = await connect(new URL("/devices/big?service=interop", location.href), { worker });
  const called: number = await device.add(2, 3);
  const refused: string = await device.fail("custom", "not today").catch((error: Error) => error.message);
  await device.p_string.set("für alle");
  const set: string = await device.p_string.get();
  const state = device.state.connect();
  await state.ready;
  await device.publish_state([1, 2, 3]);
  const wire = Array.from((await state[Symbol.asyncIterator]().next()).value as Float64Array);
  const end = await device.doubled.connect();
  const packets = end[Symbol.asyncIterator]();
  await end.send(1);
  await end.send(2);
  const pipe = [(await packets.next()).value, (await packets.next()).value];
  const changed = device.changed.once();
  await device.fire(1);
  const event: unknown[] = await changed;
  const generated: unknown[] = [];
  for await (const number of device.count_up(1, 3)) generated.push(number);
  const memory = (await device.m_numbers.read(0, 3)).length;
  await device.$.close();
  return { called, refused, set, wire, event, pipe, generated, memory, state: device.$.state };
}
