// Values as Python; these lines were run with Robot Raconteur's Python module at the test service.
import { PythonCode } from "../../web/src/panels/python_code";
import { Definitions } from "../../web/src/values/definitions";

const definitions = new Definitions([
  "service a.b\nstruct Pose\nfield double px\nfield string label\nfield Pose{int32} others\nfield double[*] grid\nfield varvalue any\nend\n" +
    "namedarray Point\nfield double x\nend\npod Sample\nfield uint8[8-] tag\nfield Point at\nfield Point[2-] path\nend\n",
]);

function written(value: unknown, type: string): string[] {
  const code = new PythonCode(definitions);
  const result = code.value(value, type, "a.b");
  return [...(code.usesNumpy ? ["import numpy"] : []), ...code.lines, result];
}

test("structures are made by the service's types, also within others", () => {
  const inner = { px: 2, label: null, others: null, grid: { dims: [2, 1], data: Float64Array.of(1.5, 2) }, any: "s" };
  const outer = { px: 1, label: "a", others: new Map([[7, inner]]), grid: null, any: [1, 2] };
  expect(written([outer], "Pose{list}")).toEqual([
    "import numpy",
    'value1 = RRN.NewStructure("a.b.Pose", robot)',
    "value1.px = 1",
    'value1.label = "a"',
    'value2 = RRN.NewStructure("a.b.Pose", robot)',
    "value2.px = 2",
    "value2.label = None",
    "value2.others = None",
    'value2.grid = numpy.reshape([1.5, 2], [2, 1], order="F")',
    'value2.any = RR.VarValue("s", "string")',
    "value1.others = {7: value2}",
    "value1.grid = None",
    'value1.any = RR.VarValue([1, 2], "double[]")',
    "[value1]",
  ]);
});

test("pods and named arrays are numpy's, with room for the most that there may be", () => {
  const sample = { tag: Uint8Array.of(5, 6), at: { x: 1 }, path: [{ x: Infinity }] };
  expect(written(sample, "Sample")).toEqual([
    "import numpy",
    'value1 = numpy.zeros((1,), dtype=RRN.GetPodDType("a.b.Sample", robot))',
    'value1[0]["tag"]["len"] = 2',
    'value1[0]["tag"]["array"][:2] = [5, 6]',
    'value1[0]["at"]["x"] = 1',
    'value1[0]["path"]["len"] = 1',
    'value1[0]["path"]["array"][0]["x"] = float("infinity")',
    "value1",
  ]);
  expect(written([{ x: 1 }, { x: 2 }], "Point[]").slice(1)).toEqual([
    'value1 = numpy.zeros((2,), dtype=RRN.GetNamedArrayDType("a.b.Point", robot))',
    'value1[0]["x"] = 1',
    'value1[1]["x"] = 2',
    "value1",
  ]);
  expect(written(Int16Array.of(2), "varvalue")).toEqual(['RR.VarValue([2], "int16[]")']);
  expect(written([true, NaN, 2n, null], "varvalue")).toEqual(['[True, float("nan"), 2, None]']);
});
