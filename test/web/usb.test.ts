// Addresses of USB devices, which the page reaches without the gateway.
import { is_usb, usb_url } from "../../web/src/gateway/usb_devices";

it.each([
  ["usb:robot", "Create", "rr+usb:///?nodename=robot&service=Create"],
  ["usb:a.b-c_d", "a b", "rr+usb:///?nodename=a.b-c_d&service=a+b"],
  ["usb:10203040-5060-7080-90a0-b0c0d0e0f001", "x", "rr+usb:///?nodeid=10203040-5060-7080-90a0-b0c0d0e0f001&service=x"],
])("%s, service %s", (device, service, url) => {
  expect(is_usb(device)).toBe(true);
  expect(usb_url(device, service)).toBe(url);
});

it("are none of the gateway's: those have no colon in their names", () => {
  expect(is_usb("usb")).toBe(false);
  expect(is_usb("create")).toBe(false);
});
