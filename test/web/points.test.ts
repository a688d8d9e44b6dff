// Point clouds and scans of laser scanners in values.
import { pointsIn } from "../../web/src/values/points";

const rounded = (points: Float32Array | undefined) =>
  points && Array.from(points, (each) => Math.round(each * 1e4) / 1e4 + 0);
const point = (x: number, y: number, z: number) => ({ x, y, z });
const info = {
  angle_min: -Math.PI / 2,
  angle_increment: Math.PI / 2,
  angle_count: 3,
  vertical_angle_min: 0,
  vertical_angle_increment: 0,
  range_min: 0.1,
  range_max: 30,
};

it("finds a cloud in the packet of a sensor, without points that are no numbers", () => {
  const points = [point(1, 2, 3), point(NaN, 0, 0), point(4, 5, 6)];
  const packet = { sensor_data: { data_header: null }, point_cloud: { bounds: null, is_dense: false, points } };
  expect(rounded(pointsIn(packet))).toEqual([1, 2, 3, 4, 5, 6]);
});

it("takes the places of points that have a colour and a normal, too", () => {
  const cloud = { is_dense: true, points: [{ point: point(1, 0, 2), intensity: 1, normal: point(9, 9, 9) }] };
  expect(rounded(pointsIn(cloud))).toEqual([1, 0, 2]);
});

it("turns ranges into points, x ahead and y to the left, without those that hit nothing", () => {
  const scan = { scan_info: info, ranges: Float64Array.of(2, 3, 4), intensities: new Float64Array() };
  expect(rounded(pointsIn(scan))).toEqual([0, -2, 0, 3, 0, 0, 0, 4, 0]);
  expect(rounded(pointsIn({ ...scan, ranges: Float64Array.of(0, Infinity, 31) }))).toEqual([]);
});

it("goes on with the next row where one ends, and with a part where the one before ended", () => {
  const rows = { ...info, vertical_angle_increment: Math.PI / 2 };
  const ranges = Float32Array.of(1, 1, 1, 5);
  expect(rounded(pointsIn({ scan_info: rows, ranges }))?.slice(9)).toEqual([0, 0, 5]);
  expect(
    rounded(pointsIn({ scan_info: info, data_offset: 1, data_total_len: 3, ranges: Float64Array.of(3, 4) })),
  ).toEqual([3, 0, 0, 0, 4, 0]);
});

it("finds none where there are none", () => {
  const strange = Object.create({ points: [], is_dense: true }) as object;
  for (const value of [null, undefined, 7, "points", [], strange, { points: [point(1, 2, 3)] }, { ranges: [1] }])
    expect(pointsIn(value)).toBeUndefined();
});
