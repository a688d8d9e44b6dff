// URLs of services.
import { parse_service_url } from "../../wasm-client/dist/url.js";

const parse = (text: string, base?: string) => {
  const { socket, service, nodeId, nodeName } = parse_service_url(text, base);
  return { socket: socket.href, service, nodeId, nodeName };
};

it.each([
  ["wss://gw.example/devices/create?service=Create", "wss://gw.example/devices/create?service=Create"],
  ["ws://127.0.0.1:8080/devices/a%20b?service=Create", "ws://127.0.0.1:8080/devices/a%20b?service=Create"],
  ["https://gw.example/devices/create?service=Create", "wss://gw.example/devices/create?service=Create"],
  ["http://gw.example:8080/?service=Create", "ws://gw.example:8080/?service=Create"],
  ["rr+ws://localhost:52222/?service=Create", "ws://localhost:52222/?service=Create"],
  ["rr+wss://gw.example/x?token=1&service=Create", "wss://gw.example/x?token=1&service=Create"],
  ["rr+tcp://localhost:52222/?service=Create", "ws://localhost:52222/?service=Create"],
  ["rr+tcp://localhost:80/?service=Create", "ws://localhost/?service=Create"],
  ["rr+tcp://localhost?service=Create", "ws://localhost:48653/?service=Create"],
  ["rr+tcp://[::1]:52222/?service=Create", "ws://[::1]:52222/?service=Create"],
  ["rr+tcp://[::1]/?service=Create", "ws://[::1]:48653/?service=Create"],
  ["WSS://gw.example/?service=Create#part", "wss://gw.example/?service=Create"],
])("opens %s as %s", (text, socket) => {
  expect(parse(text)).toEqual({ socket, service: "Create", nodeId: undefined, nodeName: undefined });
});

it("reads the node that is meant", () => {
  const id = "82301bf1-e1ef-4e89-8d8f-0848291587ac";
  expect(parse(`ws://h/?nodeid=${id}&nodename=my.robot&service=a`)).toMatchObject({ nodeId: id, nodeName: "my.robot" });
});

it("is relative to the page where there is one", () => {
  expect(parse("/devices/create?service=Create", "https://gw.example/app/").socket).toBe("wss://gw.example/devices/create?service=Create");
  expect(parse("devices/create?service=Create", "http://gw.example:8080/app/").socket).toBe("ws://gw.example:8080/app/devices/create?service=Create");
  expect(parse("//other.example/?service=Create", "http://gw.example/").socket).toBe("ws://other.example/?service=Create");
});

it.each([
  ["ws://gw.example/", "names no service"],
  ["ws://gw.example/?service=", "names no service"],
  ["rrs+tcp://gw.example/?service=a", "use rr+wss"],
  ["rr+tpc://gw.example/?service=a", "scheme unknown; known: ws, wss"],
  ["ftp://gw.example/?service=a", "scheme unknown"],
  ["/devices/create?service=Create", "no page that it could be relative to"],
  ["ws://gw.example:99999/?service=a", "Invalid URL"],
  ["ws://?service=a", "Invalid URL"],
  ["", "no page that it could be relative to"],
])("refuses %j", (text, message) => {
  expect(() => parse(text)).toThrow(message);
});
