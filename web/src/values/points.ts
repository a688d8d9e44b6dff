// Points in space inside a value: point clouds, and what laser scanners measure. Layer: web/values, pure.
// Source: com.robotraconteur.pointcloud (PointCloud, PointCloud2, their parts and forms with single precision),
// com.robotraconteur.laserscan (LaserScan, and the same).

/** x, y and z of each, in metres. */
export type Points = Float32Array;

const MOST_POINTS = 500_000;
const MOST_DEPTH = 3;

/** The first cloud or scan of a value, which may be a part of one; undefined: it has none. Points that are no numbers are left out. */
export function pointsIn(value: unknown, depth = 0): Points | undefined {
  if (!isStruct(value)) return undefined;
  const found = cloudOf(value) ?? scanOf(value);
  if (found || depth === MOST_DEPTH) return found;
  for (const field of Object.values(value)) {
    const inner = pointsIn(field, depth + 1);
    if (inner) return inner;
  }
  return undefined;
}

function cloudOf(value: Fields): Points | undefined {
  const points = own(value, "points");
  if (!Array.isArray(points) || own(value, "is_dense") === undefined) return undefined;
  const out = new Writer(points.length);
  for (const each of points.slice(0, MOST_POINTS) as unknown[]) {
    const at = isStruct(each) ? (own(each, "point") ?? each) : null;
    if (isStruct(at)) out.add(Number(own(at, "x")), Number(own(at, "y")), Number(own(at, "z")));
  }
  return out.points;
}

/** Rows of a scanner that turns, one above the other; x ahead, y to the left. */
function scanOf(value: Fields): Points | undefined {
  const [info, ranges] = [own(value, "scan_info"), own(value, "ranges")];
  if (!isStruct(info) || !(ranges instanceof Float64Array || ranges instanceof Float32Array)) return undefined;
  const number = (name: string): number => Number(own(info, name));
  const [first, step, count] = [number("angle_min"), number("angle_increment"), number("angle_count")];
  const [lowest, rise] = [number("vertical_angle_min") || 0, number("vertical_angle_increment") || 0];
  const [nearest, farthest] = [number("range_min"), number("range_max")];
  const perRow = count > 0 ? count : ranges.length;
  const offset = Number(own(value, "data_offset") ?? 0); // of a part
  const out = new Writer(ranges.length);
  for (const [i, range] of ranges.subarray(0, MOST_POINTS).entries()) {
    if (range < nearest || range > farthest) continue; // hit nothing
    const turn = first + step * ((offset + i) % perRow);
    const up = lowest + rise * Math.floor((offset + i) / perRow);
    const flat = range * Math.cos(up);
    out.add(flat * Math.cos(turn), flat * Math.sin(turn), range * Math.sin(up));
  }
  return out.points;
}

class Writer {
  readonly #numbers: Float32Array;
  #count = 0;

  constructor(points: number) {
    this.#numbers = new Float32Array(3 * Math.min(points, MOST_POINTS));
  }

  get points(): Points {
    return this.#numbers.subarray(0, this.#count);
  }

  add(x: number, y: number, z: number): void {
    if (!Number.isFinite(x + y + z)) return;
    this.#numbers.set([x, y, z], this.#count);
    this.#count += 3;
  }
}

type Fields = Readonly<Record<string, unknown>>;

function isStruct(value: unknown): value is Fields {
  return typeof value === "object" && value !== null && !Array.isArray(value) && !ArrayBuffer.isView(value);
}

/** What a struct of a device has under that name, not what all objects have. */
function own(value: Fields, name: string): unknown {
  return Object.hasOwn(value, name) ? value[name] : undefined;
}
