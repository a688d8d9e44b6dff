// The part of WebUSB that is used here: TypeScript's own library does not know it. Layer: wasm-client/ts.
// Source: https://wicg.github.io/webusb/

export interface UsbFilter {
  vendorId?: number;
  productId?: number;
  classCode?: number;
  subclassCode?: number;
  protocolCode?: number;
  serialNumber?: string;
}

/** navigator.usb */
export interface WebUsb extends EventTarget {
  getDevices(): Promise<WebUsbDevice[]>;
  /** Not in workers. */
  requestDevice?: ((options: { filters: UsbFilter[] }) => Promise<WebUsbDevice>) | undefined;
}

/** USBDevice */
export interface WebUsbDevice {
  readonly usbVersionMajor: number;
  readonly usbVersionMinor: number;
  readonly usbVersionSubminor: number;
  readonly deviceClass: number;
  readonly vendorId: number;
  readonly productId: number;
  readonly manufacturerName?: string | null | undefined;
  readonly productName?: string | null | undefined;
  readonly serialNumber?: string | null | undefined;
  readonly configuration: WebUsbConfiguration | null;
  readonly configurations: readonly WebUsbConfiguration[];
  readonly opened: boolean;
  open(): Promise<void>;
  close(): Promise<void>;
  selectConfiguration(value: number): Promise<void>;
  claimInterface(number: number): Promise<void>;
  releaseInterface(number: number): Promise<void>;
  controlTransferIn(setup: WebUsbSetup, length: number): Promise<WebUsbInResult>;
  controlTransferOut(setup: WebUsbSetup, data?: BufferSource): Promise<WebUsbOutResult>;
  transferIn(endpoint: number, length: number): Promise<WebUsbInResult>;
  transferOut(endpoint: number, data: BufferSource): Promise<WebUsbOutResult>;
}

export interface WebUsbConfiguration {
  readonly configurationValue: number;
  readonly interfaces: readonly {
    readonly interfaceNumber: number;
    readonly alternates: readonly {
      readonly alternateSetting: number;
      readonly interfaceClass: number;
      readonly endpoints: readonly WebUsbEndpoint[];
    }[];
  }[];
}

export interface WebUsbEndpoint {
  readonly endpointNumber: number;
  readonly direction: "in" | "out";
  readonly type: "bulk" | "interrupt" | "isochronous";
  readonly packetSize: number;
}

export interface WebUsbSetup {
  requestType: "standard" | "class" | "vendor";
  recipient: "device" | "interface" | "endpoint" | "other";
  request: number;
  value: number;
  index: number;
}

export interface WebUsbInResult {
  readonly data?: DataView | null | undefined;
  readonly status?: "ok" | "stall" | "babble" | undefined;
}

export interface WebUsbOutResult {
  readonly bytesWritten: number;
  readonly status?: "ok" | "stall" | "babble" | undefined;
}
