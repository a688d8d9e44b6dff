// Names the numbers in a sensor packet of the iRobot Create's serial interface.
// Layer: web/robot, pure. Source: Create Open Interface, sensor packets 7 to 42 (big-endian); groups are runs of them.

export interface SensorReadings {
  bumpers?: number;
  voltageMv?: number;
  chargeMah?: number;
  rightWheelMmS?: number;
  leftWheelMmS?: number;
}

/** Bytes of each packet 7, 8, ... 42. */
const SIZES = [
  1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 1, 2, 2, 1, 2, 2, 2, 2, 2, 2, 2, 1, 2, 1, 1, 1, 1, 1, 2, 2, 2, 2,
];
const FIRST = 7;

/** Group number to first and last packet. */
const GROUPS: Readonly<Record<number, readonly [number, number]>> = {
  0: [7, 26],
  1: [7, 16],
  2: [17, 20],
  3: [21, 26],
  4: [27, 34],
  5: [35, 42],
  6: [7, 42],
};

/** Readings by name; empty when the packet is unknown or its length does not fit its number. */
export function readSensorPacket(id: number, data: Uint8Array): SensorReadings {
  const [first, last] = GROUPS[id] ?? [id, id];
  const sizes = SIZES.slice(first - FIRST, last - FIRST + 1);
  if (first < FIRST || sizes.reduce((sum, size) => sum + size, 0) !== data.length || sizes.length === 0) return {};
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const readings: SensorReadings = {};
  let offset = 0;
  for (let packet = first; packet <= last; packet++) {
    readOne(packet, view, offset, readings);
    offset += SIZES[packet - FIRST] ?? 0;
  }
  return readings;
}

function readOne(packet: number, view: DataView, offset: number, readings: SensorReadings): void {
  if (packet === 7)
    readings.bumpers = view.getUint8(offset) & 0x03; // bit 0 right, bit 1 left; the rest are wheel drops
  else if (packet === 22) readings.voltageMv = view.getUint16(offset);
  else if (packet === 25) readings.chargeMah = view.getUint16(offset);
  else if (packet === 41) readings.rightWheelMmS = view.getInt16(offset);
  else if (packet === 42) readings.leftWheelMmS = view.getInt16(offset);
}
