// `await using` where the engine knows neither the word nor the symbol: by the symbol that compilers have in its place.
import type { ObjectInfo } from "../../wasm-client/dist/node.js";

const definition = `service test.dispose
object Root
  function int32{generator} count(int32 last)
end`;

interface Root {
  readonly $: ObjectInfo;
  count(last: number): AsyncGenerator<number>;
}
interface Ending {
  [placeholder: symbol]: (() => Promise<void>) | undefined;
}
const type = "test.dispose.Root";
const placeholder = Symbol.for("Symbol.asyncDispose");

beforeEach(() => {
  const newer = Symbol;
  const older = (description?: string) => newer(description);
  Object.setPrototypeOf(older, newer);
  Object.defineProperty(older, "asyncDispose", { value: undefined });
  vi.stubGlobal("Symbol", older);
  vi.resetModules();
});
afterEach(() => void vi.unstubAllGlobals());

it("ends a device, a generator, a lease and a session", async () => {
  const { FakeGateway } = await import("./fake_gateway.js");
  const { Info } = await import("../../wasm-client/dist/internal.js");
  const { lease } = await import("../../wasm-client/dist/node.js");
  const { serve } = await import("../../wasm-client/dist/serve/node.js");
  const gateway = new FakeGateway();
  const object = { count: () => [1, 2, 3] };
  const device = await serve({ url: "ws://gateway", name: "phone", service: "Phone", definition, type, object });
  const root = await gateway.connect<Root>();
  const run = root.count(3);
  await run.next();
  const end = async (held: unknown) => (held as Ending)[placeholder]!();
  await end(run);
  expect(await run.next()).toEqual({ done: true, value: undefined });
  const asked = vi.spyOn(Info.sessionOf(root), "request").mockResolvedValue(null);
  const held = await lease(root);
  await end(held);
  expect(held.state).toBe("released");
  asked.mockRestore();
  await end(root);
  await end(device);
  expect(gateway.control.isClosed).toBe(true);
});
