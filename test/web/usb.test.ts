// Addresses of USB devices, which the page reaches without the gateway.
import { isUsb, usbUrl } from "../../web/src/gateway/usb_devices";

it.each([
  ["usb:robot", "Create", "rr+usb:///?nodename=robot&service=Create"],
  ["usb:a.b-c_d", "a b", "rr+usb:///?nodename=a.b-c_d&service=a+b"],
  ["usb:10203040-5060-7080-90a0-b0c0d0e0f001", "x", "rr+usb:///?nodeid=10203040-5060-7080-90a0-b0c0d0e0f001&service=x"],
])("%s, service %s", (device, service, url) => {
  expect(isUsb(device)).toBe(true);
  expect(usbUrl(device, service)).toBe(url);
});

it("are none of the gateway's: those have no colon in their names", () => {
  expect(isUsb("usb")).toBe(false);
  expect(isUsb("create")).toBe(false);
});
