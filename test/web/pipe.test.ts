// Sending packets: an endpoint that receives too, and one that was closed meanwhile.
import { Outlet } from "../../web/src/panels/outlet";
import { remoteOf } from "../../web/src/robot/remote";

function makeEndpoint() {
  const packets = [1, 2, 3];
  const endpoint = {
    isClosed: false,
    send: vi.fn((_: unknown) => (endpoint.isClosed ? Promise.reject(new Error("closed")) : Promise.resolve())),
    close: vi.fn(() => Promise.resolve()),
    [Symbol.asyncIterator]: () => ({
      next: () => Promise.resolve(packets.length > 0 ? { value: packets.shift() } : { done: true, value: undefined }),
    }),
  };
  return { endpoint, packets };
}

test("what an endpoint receives is taken from it, though it is opened to send", async () => {
  const { endpoint, packets } = makeEndpoint();
  const info = { members: [{ name: "chat" }], member: () => ({ connect: () => Promise.resolve(endpoint) }) };
  expect(await remoteOf({ $: info } as never).openPipe("chat")).toBe(endpoint);
  await vi.waitFor(() => expect(packets).toEqual([]));
});

test("a packet after the endpoint was closed, or could not be opened, goes to a new one", async () => {
  const [one, two] = [makeEndpoint().endpoint, makeEndpoint().endpoint];
  const open = vi.fn<() => Promise<typeof one>>();
  open.mockRejectedValueOnce(new Error("not yet")).mockResolvedValueOnce(one).mockResolvedValueOnce(two);
  const outlet = new Outlet(open);
  await expect(outlet.send("a")).rejects.toThrow("not yet");
  await outlet.send("b");
  await outlet.send("c");
  one.isClosed = true;
  await outlet.send("d");
  expect([one.send.mock.calls, two.send.mock.calls]).toEqual([[["b"], ["c"]], [["d"]]]);
  outlet.close();
  await vi.waitFor(() => expect(two.close).toHaveBeenCalledOnce());
});

test("whoever follows a wire gets what tells of its losses", async () => {
  const connection = { losses: () => Promise.resolve(undefined), async *[Symbol.asyncIterator]() {} };
  const info = { members: [{ name: "state" }], member: () => ({ connect: () => connection }) };
  const opened = vi.fn();
  await remoteOf({ $: info } as never)
    .wire("state", new AbortController().signal, opened)
    .next();
  expect(opened).toHaveBeenCalledWith(connection);
});
