// URLs of services.
import { parseServiceUrl } from "../../wasm-client/dist/internal.js";

const parse = (text: string, base?: string) => {
  const { address, service, nodeId, nodeName } = parseServiceUrl(text, base);
  return { address: address.href, service, nodeId, nodeName };
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
])("opens %s as %s", (text, address) => {
  expect(parse(text)).toEqual({ address, service: "Create", nodeId: undefined, nodeName: undefined });
});

it("reads the node that is meant", () => {
  const id = "82301bf1-e1ef-4e89-8d8f-0848291587ac";
  expect(parse(`ws://h/?nodeid=${id}&nodename=my.robot&service=a`)).toMatchObject({ nodeId: id, nodeName: "my.robot" });
});

it.each([
  ["rr+usb:///?nodename=robot&service=Create", "rr+usb:///?nodename=robot&service=Create"],
  ["RR+USB:///?nodename=robot&service=Create#part", "rr+usb:///?nodename=robot&service=Create"],
  ["rr+usb://localhost/?service=Create&nodename=robot", "rr+usb:///?service=Create&nodename=robot"],
  ["rr+usb://localhost?service=Create&nodename=robot", "rr+usb:///?service=Create&nodename=robot"],
])("opens %s as %s", (text, address) => {
  expect(parse(text)).toEqual({ address, service: "Create", nodeId: undefined, nodeName: "robot" });
});

it("is relative to the page where there is one", () => {
  expect(parse("/devices/create?service=Create", "https://gw.example/app/").address).toBe(
    "wss://gw.example/devices/create?service=Create",
  );
  expect(parse("devices/create?service=Create", "http://gw.example:8080/app/").address).toBe(
    "ws://gw.example:8080/app/devices/create?service=Create",
  );
  expect(parse("//other.example/?service=Create", "http://gw.example/").address).toBe(
    "ws://other.example/?service=Create",
  );
});

it.each([
  ["ws://gw.example/", "names no service"],
  ["ws://gw.example/?service=", "names no service"],
  ["rrs+tcp://gw.example/?service=a", "use rr+wss"],
  ["rr+tpc://gw.example/?service=a", "scheme unknown; known: ws, wss"],
  ["rr+usb:///?service=a", 'names no node; add "nodeid=ID" or "nodename=NAME"'],
  ["rr+usb:///?service=a&nodeid=", "names no node"],
  ["rr+usb:///?nodename=robot", "names no service"],
  ["rr+usb://robot/?nodename=robot&service=a", "found a host, port or path"],
  ["rr+usb://localhost:80/?nodename=robot&service=a", "found a host, port or path"],
  ["rr+usb:///robot?nodename=robot&service=a", "found a host, port or path"],
  ["rr+usb:?nodename=robot&service=a", "found a host, port or path"],
  ["ftp://gw.example/?service=a", "scheme unknown"],
  ["/devices/create?service=Create", "no page that it could be relative to"],
  ["ws://gw.example:99999/?service=a", "Invalid URL"],
  ["ws://?service=a", "Invalid URL"],
  ["", "no page that it could be relative to"],
])("refuses %j", (text, message) => {
  expect(() => parse(text)).toThrow(message);
});
