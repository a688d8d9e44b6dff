"""Values of the scenarios as the reference's Python package holds them (README.md, "Values")."""
import numpy
import RobotRaconteur as RR

TYPE = "experimental.interop"

NUMBERS = {
    "double": numpy.float64, "single": numpy.float32,
    "int8": numpy.int8, "uint8": numpy.uint8, "int16": numpy.int16, "uint16": numpy.uint16,
    "int32": numpy.int32, "uint32": numpy.uint32, "int64": numpy.int64, "uint64": numpy.uint64,
    "cdouble": numpy.complex128, "csingle": numpy.complex64, "bool": numpy.bool_,
}
STRUCTS = {"Pose", "Everything"}
PODS = {"Sample"}
NAMED_ARRAYS = {"Vector3": 3, "Quaternion": 4, "Transform": 7}
NAMED_ARRAY_FIELDS = {("x", "y", "z"), ("w", "x", "y", "z"), ("rotation", "translation")}


class Values:
    """Converts for one connected object, whose definition makes the types."""

    def __init__(self, client):
        self._client = client

    def build(self, tagged):
        """A scenario's value -> what the package takes."""
        if tagged is None or isinstance(tagged, str):
            return tagged
        (tag, body), = tagged.items()
        base, _, rest = tag.partition("[")
        if tag == "ramp":
            return numpy.arange(body, dtype=numpy.float64)
        if tag == "list":
            return [self.build(item) for item in body]
        if tag in ("map{int32}", "map{string}"):
            return {key: self.build(item) for key, item in body}
        if tag == "varvalue":
            return RR.VarValue(self.build(body), type_text(body))
        if tag == "Color":
            return body
        if base in STRUCTS:
            structure = RR.RobotRaconteurNode.s.NewStructure(f"{TYPE}.{base}", self._client)
            for name, field in body.items():
                setattr(structure, name, self.build(field))
            return structure
        if base in PODS:
            return self._shaped(rest, body, lambda items: self._pods(base, items))
        if base in NAMED_ARRAYS:
            return self._shaped(rest, body, lambda items: self._named_array(base, items))
        if base in NUMBERS:
            items = self._shaped(rest, body, lambda items: numpy.array(number_items(base, items), NUMBERS[base]))
            return items if rest else items.item()
        raise ValueError(f"scenario value has unknown type {tag!r}")

    def item_type(self, word):
        """The dtype of arrays of a number, pod or named array."""
        if word in PODS:
            return RR.RobotRaconteurNode.s.GetPodDType(f"{TYPE}.{word}", self._client)
        if word in NAMED_ARRAYS:
            return RR.RobotRaconteurNode.s.GetNamedArrayDType(f"{TYPE}.{word}", self._client)
        return NUMBERS[word]

    def _shaped(self, rest, body, make):
        if not rest:
            return make([body])
        if rest == "]":
            return make(body)
        return make(body["data"]).reshape(body["dims"], order="F")

    def _pods(self, name, items):
        dtype = RR.RobotRaconteurNode.s.GetPodDType(f"{TYPE}.{name}", self._client)
        array = numpy.zeros((len(items),), dtype)
        for index, fields in enumerate(items):
            for field, tagged in fields.items():
                value, column = self.build(tagged), array[field]
                if column.dtype.names == ("len", "array"):  # up to n items: their number beside them
                    column["len"][index] = len(value)
                    column["array"][index][: len(value)] = value
                elif column.dtype.names in NAMED_ARRAY_FIELDS:
                    column[index] = value[0]
                else:
                    column[index] = value
        return array

    def _named_array(self, name, items):
        flat = numpy.array(items, numpy.float64).reshape((-1, NAMED_ARRAYS[name]))
        return RR.RobotRaconteurNode.s.ArrayToNamedArray(
            flat, RR.RobotRaconteurNode.s.GetNamedArrayDType(f"{TYPE}.{name}", self._client))


def number_items(base, items):
    if isinstance(items, (list, tuple)) and items and base in ("cdouble", "csingle"):
        return [complex(*item) for item in items]
    if base in ("double", "single"):
        return [float(item) for item in items]
    return [int(item) for item in items]


def type_text(tagged):
    if tagged is None:
        return "void"
    if isinstance(tagged, str):
        return "string"
    (tag, body), = tagged.items()
    base = tag.partition("[")[0]
    if tag == "list":
        return "varvalue{list}"
    if tag.startswith("map"):
        return "varvalue" + tag[3:]
    return tag if base in NUMBERS else f"{TYPE}.{tag}"


def plain(value):
    """What the package gives -> the plain JSON of results."""
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, RR.VarValue):
        return plain(value.data)
    if isinstance(value, list):
        return {"list": [plain(item) for item in value]}
    if isinstance(value, dict):
        return {"map": [[key, plain(value[key])] for key in sorted(value)]}
    if isinstance(value, numpy.ndarray):
        return plain_array(value)
    if isinstance(value, numpy.void):
        return plain_record(value)
    if isinstance(value, (bool, numpy.bool_)):
        return bool(value)
    if isinstance(value, (int, numpy.integer)):
        number = int(value)
        return number if abs(number) <= 2**53 else str(number)
    if isinstance(value, (complex, numpy.complexfloating)):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, (float, numpy.floating)):
        return plain_float(float(value))
    fields = {name: getattr(value, name) for name in dir(value) if not name.startswith("_") and name not in ("this", "thisown")}
    return {name: plain(field) for name, field in fields.items() if not callable(field)}


def plain_float(number):
    if number != number:
        return "NaN"
    if number in (float("inf"), float("-inf")):
        return "Infinity" if number > 0 else "-Infinity"
    return number


def plain_array(array):
    items = array.flatten(order="F")
    if array.dtype.names in NAMED_ARRAY_FIELDS:
        data = [plain(number) for number in RR.RobotRaconteurNode.s.NamedArrayToArray(items).flatten()]
    else:
        data = [plain(item) for item in items]
    if array.ndim > 1:
        return {"dims": list(array.shape), "data": data}
    return data


def plain_record(record):
    if record.dtype.names in NAMED_ARRAY_FIELDS:
        return plain_array(numpy.array([record], record.dtype))
    if record.dtype.names == ("len", "array"):
        return plain_array(record["array"][: int(record["len"])])
    return {name: plain(record[name]) for name in record.dtype.names}
