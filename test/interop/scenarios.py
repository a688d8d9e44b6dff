"""What every client does with every service, and what must come of it: the one table that all directions share.

A scenario is a list of steps; README.md explains steps and values. Each step carries what is expected of it:
`expect` a plain value (None: nothing comes back), or `expect_error` the qualified name of the error.
"""
from dataclasses import dataclass


@dataclass
class Scenario:
    name: str
    steps: list
    clients: tuple = ("reference", "ours", "javascript")  # those that know its steps
    services: tuple = ("reference", "ours")  # those that can do what it asks


NATIVE = ("reference", "ours")


def plain_of(tagged):
    """The plain form of a value that a scenario sends: what must come back when it is echoed."""
    if tagged is None or isinstance(tagged, str):
        return tagged
    (tag, body), = tagged.items()
    base, _, rest = tag.partition("[")
    if tag == "list":
        return {"list": [plain_of(item) for item in body]}
    if tag.startswith("map"):
        return {"map": [[key, plain_of(item)] for key, item in body]}
    if tag == "varvalue":
        return plain_of(body)
    if base in ("Pose", "Everything"):
        return {name: plain_of(field) for name, field in body.items()}
    if base == "Sample":
        if not rest:
            return [{name: plain_of(field) for name, field in body.items()}]
        if rest == "]":
            return [{name: plain_of(field) for name, field in item.items()} for item in body]
        return {"dims": body["dims"], "data": [{name: plain_of(field) for name, field in item.items()} for item in body["data"]]}
    return body


def round_trip(member, *values):
    steps = []
    for value in values:
        steps.append({"set": member, "value": value, "expect": None})
        steps.append({"get": member, "expect": plain_of(value)})
    return steps


POSE = {"Pose": {"px": {"double": 1.5}, "py": {"double": -2.25}, "label": "dock"}}
OTHER_POSE = {"Pose": {"px": {"double": 0.0}, "py": {"double": 1e300}, "label": "Zürich ✓"}}
SAMPLE = {"Sample": {"id": {"int32": -7}, "reading": {"double[]": [1.0, 2.0, 3.0]}, "tag": {"uint8[]": [9, 8]},
                     "position": {"Vector3": [0.5, 0.25, 0.125]}}}
OTHER_SAMPLE = {"Sample": {"id": {"int32": 2147483647}, "reading": {"double[]": [-1.0, 0.0, 1.0]}, "tag": {"uint8[]": []},
                           "position": {"Vector3": [4.0, 5.0, 6.0]}}}
TRANSFORM = {"Transform": [1.0, 0.0, 0.0, 0.0, 10.0, 20.0, 30.0]}
ZERO_SAMPLE = {"id": 0, "reading": [0.0, 0.0, 0.0], "tag": [], "position": [0.0, 0.0, 0.0]}
STOP = "RobotRaconteur.StopIteration"
OUTSIDE = "RobotRaconteur.OutOfRange"


def read(member, of, position, size, expect, **more):
    return {"read_memory": member, "of": of, "position": position, "size": size, "expect": expect, **more}


def digest(*arguments):
    return read(*arguments, digest=True)


def read_fails(member, of, position, size, error):
    return {"read_memory": member, "of": of, "position": position, "size": size, "expect_error": error}


def write(member, position, value):
    return {"write_memory": member, "position": position, "value": value, "expect": None}


def poses(*px):
    return [{**plain_of(POSE), "px": float(x)} for x in px]


EVERYTHING = {"Everything": {
    "first": POSE,
    "missing": None,
    "items": {"list": [POSE, OTHER_POSE]},
    "by_number": {"map{int32}": [[-1, POSE], [5, OTHER_POSE]]},
    "by_name": {"map{string}": [["a", POSE], ["b c", OTHER_POSE]]},
    "any": {"varvalue": {"double[]": [1.0, 2.0]}},
    "nothing": None,
    "fixed": {"int32[]": [1, 2, 3]},
    "upto": {"int32[]": [4]},
    "grid": {"double[*]": {"dims": [2, 2], "data": [1.0, 2.0, 3.0, 4.0]}},
    "color": {"Color": -3},
    "frame": TRANSFORM,
    "points": {"Vector3[]": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]},
    "sample": SAMPLE,
    "samples": {"Sample[]": [SAMPLE["Sample"], OTHER_SAMPLE["Sample"]]},
    "names": {"list": ["one", "", "three"]},
    "ok": {"bool": True},
    "large": {"uint64": 18446744073709551615},
}}

INTEGERS = {"int8": 8, "int16": 16, "int32": 32, "int64": 64, "uint8": 8, "uint16": 16, "uint32": 32, "uint64": 64}


def range_of(word):
    bits = INTEGERS[word]
    return (0, 2**bits - 1) if word.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def json_integer(number):
    """As plain results write it: beyond 2^53 as decimal text."""
    return number if abs(number) <= 2**53 else str(number)


def integer_scalars():
    return [step for word in INTEGERS for step in round_trip(
        "p_" + word, *({word: json_integer(number)} for number in range_of(word)), {word: 1})]


def integer_arrays():
    return [step for word in INTEGERS for step in round_trip(
        f"p_{word}s", {word + "[]": [json_integer(number) for number in (*range_of(word), 0, 1)]}, {word + "[]": []})]


EVERYTHING["Everything"]["large"] = {"uint64": str(2**64 - 1)}

SCENARIOS = [
    Scenario("property_numbers", integer_scalars()
             + round_trip("p_double", {"double": 1.5}, {"double": -0.1}, {"double": 1e308}, {"double": 5e-324})
             + round_trip("p_single", {"single": 1.5}, {"single": -0.25})
             + round_trip("p_cdouble", {"cdouble": [1.5, -2.5]})
             + round_trip("p_csingle", {"csingle": [0.5, 4.0]})
             + round_trip("p_bool", {"bool": True}, {"bool": False})
             + round_trip("p_color", {"Color": 2}, {"Color": -3})),
    Scenario("property_string", round_trip("p_string", "", "plain", "Zürich ✓ 🤖", "x" * 100000, "a\tb\nc\"\\")),
    Scenario("property_arrays", integer_arrays()
             + round_trip("p_doubles", {"double[]": [1.0, -2.5, 1e-300]}, {"double[]": []}, {"double[]": [7.0]})
             + round_trip("p_singles", {"single[]": [0.5, 0.25]})
             + round_trip("p_cdoubles", {"cdouble[]": [[1.0, 2.0], [3.0, -4.0]]})
             + round_trip("p_csingles", {"csingle[]": [[0.5, 0.25]]})
             + round_trip("p_bools", {"bool[]": [True, False, True]})
             + round_trip("p_three_doubles", {"double[]": [1.0, 2.0, 3.0]})
             + round_trip("p_up_to_four", {"int32[]": []}, {"int32[]": [1, 2, 3, 4]})),
    Scenario("property_multidim_arrays",
             round_trip("p_grid", {"double[*]": {"dims": [2, 3], "data": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}},
                        {"double[*]": {"dims": [2, 1, 2], "data": [1.0, 2.0, 3.0, 4.0]}})
             + round_trip("p_two_by_three", {"int16[*]": {"dims": [2, 3], "data": [1, -2, 3, -4, 5, -6]}})
             + round_trip("p_image", {"uint8[*]": {"dims": [3, 2], "data": [0, 1, 2, 253, 254, 255]}})),
    Scenario("property_structures", round_trip("p_pose", POSE, OTHER_POSE, None) + round_trip("p_everything", EVERYTHING)),
    Scenario("property_named_arrays", round_trip("p_vector", {"Vector3": [1.0, 2.0, 3.0]})
             + round_trip("p_vectors", {"Vector3[]": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}, {"Vector3[]": []})
             + round_trip("p_vector_grid", {"Vector3[*]": {"dims": [2, 2], "data": [float(n) for n in range(12)]}})
             + round_trip("p_transform", TRANSFORM)),
    Scenario("property_pods", round_trip("p_sample", SAMPLE)
             + round_trip("p_samples", {"Sample[]": [SAMPLE["Sample"], OTHER_SAMPLE["Sample"]]}, {"Sample[]": []})
             + round_trip("p_sample_grid", {"Sample[*]": {"dims": [1, 2], "data": [OTHER_SAMPLE["Sample"], SAMPLE["Sample"]]}})),
    Scenario("property_containers",
             round_trip("p_double_list", {"list": [{"double": 1.0}, {"double": 2.0}]}, {"list": []}, None)
             + round_trip("p_string_list", {"list": ["a", "", "ü"]})
             + round_trip("p_array_list", {"list": [{"double[]": [1.0, 2.0]}, {"double[]": [3.0]}]})
             + round_trip("p_pose_list", {"list": [POSE, OTHER_POSE]})
             + round_trip("p_double_map", {"map{int32}": [[-5, {"double": 1.0}], [0, {"double": 2.0}]]}, {"map{int32}": []})
             + round_trip("p_string_map", {"map{string}": [["", "empty"], ["key two", "2"]]})
             + round_trip("p_pose_map", {"map{string}": [["here", POSE]]})),
    Scenario("property_varvalues",
             round_trip("p_any", {"varvalue": "text"}, {"varvalue": {"double[]": [1.0, 2.0]}}, {"varvalue": POSE},
                        {"varvalue": {"Vector3[]": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}}, None)
             + round_trip("p_any_list", {"list": [{"varvalue": "text"}, {"varvalue": {"int16[]": [1, 2]}}]})
             + round_trip("p_any_map", {"map{string}": [["a", {"varvalue": POSE}], ["b", {"varvalue": "text"}]]})),
    Scenario("property_directions", [
        {"get": "version", "expect": "1"},
        {"set": "secret", "value": {"double": 4.5}, "expect": None},
        {"get": "seen_secret", "expect": 4.5}]),
    Scenario("functions", [
        {"call": "nothing", "expect": None},
        {"call": "add", "args": [{"double": 1.5}, {"double": 2.25}], "expect": 3.75},
        {"call": "join", "args": [{"list": ["a", "b", "c"]}, ", "], "expect": "a, b, c"},
        {"call": "shift", "args": [POSE, {"double": 1.0}, {"double": 0.25}],
         "expect": {"px": 2.5, "py": -2.0, "label": "dock"}},
        {"call": "ramp", "args": [{"uint32": 4}], "expect": [0.0, 1.0, 2.0, 3.0]},
        {"call": "sum", "args": [{"double[]": [1.0, 2.0, 3.5]}], "expect": 6.5},
        {"call": "echo", "args": [{"varvalue": "text"}], "expect": "text"}]),
    Scenario("large_arrays", [
        {"call": "ramp", "args": [{"uint32": 1310720}], "digest": True,
         "expect": {"count": 1310720, "first": 0.0, "last": 1310719.0, "sum": 858992803840.0}},
        {"call": "sum", "args": [{"ramp": 1310720}], "expect": 858992803840.0}]),
    Scenario("errors", [
        {"call": "fail", "args": ["custom", "it broke"], "expect_error": "experimental.interop.InteropError", "message": "it broke"},
        {"call": "fail", "args": ["operation_failed", "no luck"], "expect_error": "RobotRaconteur.OperationFailed", "message": "no luck"},
        {"call": "fail", "args": ["invalid_argument", "Zürich"], "expect_error": "RobotRaconteur.InvalidArgument", "message": "Zürich"},
        {"call": "fail", "args": ["out_of_range", "too far"], "expect_error": "RobotRaconteur.OutOfRange", "message": "too far"},
        {"call": "fail", "args": ["not_implemented", "later"], "expect_error": "RobotRaconteur.NotImplementedError", "message": "later"},
        {"call": "add", "args": [{"double": 1.0}, {"double": 1.0}], "expect": 2.0}]),
    Scenario("events", [
        {"listen": "changed", "expect": None},
        {"listen": "cleared", "expect": None},
        {"call": "fire", "args": [{"int32": 3}], "expect": None},
        {"events": "changed", "count": 3, "any_order": True, "expect": {"list": [[0.0, "number 0"], [1.0, "number 1"], [2.0, "number 2"]]}},
        {"call": "clear", "expect": None},
        {"events": "cleared", "count": 1, "expect": {"list": [[]]}}]),
    Scenario("objects", [
        {"get": "name", "on": ["head"], "expect": "head"},
        {"call": "identify", "on": ["head"], "expect": "part head"},
        {"set": "size", "value": {"double": 8.5}, "on": ["head"], "expect": None},
        {"get": "size", "on": ["head"], "expect": 8.5},
        {"call": "identify", "on": ["head", "inner"], "expect": "part head.inner"},
        {"call": "identify", "on": [["parts", 7]], "expect": "part number 7"},
        {"call": "identify", "on": [["parts", 0], "inner"], "expect": "part number 0.inner"},
        {"call": "identify", "on": [["named", "left"]], "expect": "part named left"},
        {"call": "identify", "on": [["named", "right hand"]], "expect": "part named right hand"},
        {"call": "identify", "on": [["named", "a.b"]], "expect": "part named a.b"},
        {"set": "feature", "value": "grip", "on": ["anything"], "expect": None},
        {"get": "feature", "on": ["anything"], "expect": "grip"},
        {"call": "identify", "on": [["parts", 99]], "expect_error": "RobotRaconteur.ObjectNotFound"},
        {"call": "identify", "on": ["head"], "expect": "part head"}]),
    Scenario("wires", [
        {"connect": "state", "expect": None},
        {"call": "publish_state", "args": [{"double[]": [1.0, 2.0]}], "expect": None},
        {"in_value": "state", "until": [1.0, 2.0], "expect": [1.0, 2.0]},
        {"call": "publish_state", "args": [{"double[]": [3.0]}], "expect": None},
        {"in_value": "state", "until": [3.0], "expect": [3.0]},
        {"peek_in": "state", "expect": [3.0]},
        {"close": "state", "expect": None},
        {"connect": "pose", "expect": None},
        {"call": "publish_pose", "args": [POSE], "expect": None},
        {"in_value": "pose", "until": plain_of(POSE), "expect": plain_of(POSE)},
        {"connect": "target", "expect": None},
        {"out_value": "target", "value": {"double": 6.25}, "expect": None},
        {"get_until": "seen_target", "until": 6.25, "expect": 6.25},
        {"close": "target", "expect": None},
        {"connect": "both", "expect": None},
        {"out_value": "both", "value": {"double": 21.0}, "expect": None},
        {"in_value": "both", "until": 42.0, "expect": 42.0},
        {"close": "both", "expect": None},
        {"poke_out": "both", "value": {"double": 5.5}, "expect": None},
        {"peek_out": "both", "expect": 5.5},
        {"peek_in": "both", "expect": 11.0}]),
    Scenario("pipes", [
        {"open_pipe": "doubled", "as": "a", "expect": 1},
        {"send": "a", "values": [{"double": 1.5}, {"double": 2.0}], "expect": None},
        {"packets": "a", "count": 2, "expect": {"list": [3.0, 4.0]}},
        {"open_pipe": "doubled", "as": "b", "index": 5, "expect": 5},
        {"open_pipe": "doubled", "as": "c", "index": 3, "expect": 6},
        {"send": "c", "values": [{"double": 10.0}], "expect": None},
        {"packets": "c", "count": 1, "expect": {"list": [20.0]}},
        {"send": "a", "values": [{"double": float(n)} for n in range(100)], "expect": None},
        {"packets": "a", "count": 102, "expect": {"list": [3.0, 4.0] + [2.0 * n for n in range(100)]}},
        {"close_pipe": "a", "expect": None},
        {"send": "b", "values": [{"double": -1.0}], "expect": None},
        {"closed": "b", "expect": True},
        {"packets": "b", "count": 0, "expect": {"list": []}},
        {"send": "c", "values": [{"double": 11.0}], "expect": None},
        {"packets": "c", "count": 2, "expect": {"list": [20.0, 22.0]}},
        {"close_pipe": "c", "expect": None}]),
    Scenario("pipe_early_packets", [
        {"open_pipe": "greetings", "as": "g", "expect": 1},
        {"packets": "g", "count": 2, "expect": {"list": ["hello", "world"]}},
        {"close_pipe": "g", "expect": None}]),
    Scenario("pipe_unreliable", [
        {"open_pipe": "quick", "as": "q", "expect": 1},
        {"send": "q", "values": [{"double": 1.0}, {"double": 2.0}, {"double": 3.0}], "expect": None},
        {"packets": "q", "count": 3, "any_order": True, "expect": {"list": [2.0, 4.0, 6.0]}},
        {"close_pipe": "q", "expect": None}]),
    Scenario("pipe_broadcast", [
        {"open_pipe": "poses", "as": "left", "expect": 1},
        {"open_pipe": "poses", "as": "right", "expect": 2},
        {"call": "publish_poses", "args": [POSE, {"int32": 3}], "expect": None},
        {"packets": "left", "count": 3, "expect": {"list": poses(0, 1, 2)}},
        {"packets": "right", "count": 3, "expect": {"list": poses(0, 1, 2)}},
        {"close_pipe": "left", "expect": None},
        {"call": "publish_poses", "args": [POSE, {"int32": 1}], "expect": None},
        {"packets": "right", "count": 4, "expect": {"list": poses(0, 1, 2, 0)}}]),
    # More packets than the broadcaster lets wait: an endpoint that does not acknowledge misses some.
    Scenario("pipe_acknowledgements", [{"open_pipe": "poses", "as": "p", "expect": 1}] + [
        step for number in range(8) for step in (
            {"call": "publish_poses", "args": [POSE, {"int32": 1}], "expect": None},
            {"packets": "p", "count": number + 1, "expect": {"list": poses(*[0] * (number + 1))}})]),
    Scenario("callbacks", [
        {"answer": "ask", "value": {"double": 12.5}, "expect": None},
        {"answer": "notice", "value": None, "expect": None},
        {"call": "start_ask", "args": ["how much?"], "expect": None},
        {"asked": "ask", "count": 1, "expect": {"list": [["how much?"]]}},
        {"get_until": "answered", "until": 12.5, "expect": 12.5},
        {"get": "answer_error", "expect": ""},
        {"call": "start_notice", "args": [{"int32": 7}], "expect": None},
        {"asked": "notice", "count": 1, "expect": {"list": [[7]]}},
        {"get_until": "answered", "until": 7.0, "expect": 7.0},
        {"answer": "ask", "fail": "no idea", "expect": None},
        {"call": "start_ask", "args": ["Zürich?"], "expect": None},
        {"asked": "ask", "count": 2, "expect": {"list": [["how much?"], ["Zürich?"]]}},
        {"get_until": "answer_error", "until": "RobotRaconteur.OperationFailed", "expect": "RobotRaconteur.OperationFailed"},
        {"get": "answered", "expect": 0.0}]),
    Scenario("callback_not_set", [  # the reference's Python clients turn this into OperationFailed
        {"call": "start_ask", "args": ["anybody?"], "expect": None},
        {"get_until": "answer_error", "until": "RobotRaconteur.InvalidOperation", "expect": "RobotRaconteur.InvalidOperation"}],
        clients=("ours", "javascript")),
    Scenario("pipe_large_packets", [
        {"open_pipe": "taken", "as": "t", "expect": 1},
        {"send": "t", "values": [{"ramp": 1310720}, {"double[]": [0.5]}, {"ramp": 1310720}], "expect": None},
        {"get_until": "seen_sum", "until": 1717985607680.5, "expect": 1717985607680.5}]),
    Scenario("generators", [
        {"generate": "count_up", "as": "g", "args": [{"double": 0.5}, {"int32": 3}], "expect": None},
        {"next": "g", "expect": 0.5},
        {"next": "g", "expect": 1.5},
        {"next": "g", "expect": 2.5},
        {"next": "g", "expect_error": STOP},
        {"generate": "count_up", "as": "none", "args": [{"double": 0.0}, {"int32": 0}], "expect": None},
        {"next": "none", "expect_error": STOP},
        {"generate": "walk", "as": "a", "args": [POSE, {"int32": 2}], "expect": None},
        {"generate": "walk", "as": "b", "args": [OTHER_POSE, {"int32": 1}], "expect": None},
        {"next": "a", "expect": {**plain_of(POSE), "px": 2.5}},
        {"next": "b", "expect": {**plain_of(OTHER_POSE), "px": 1.0}},
        {"next": "b", "expect_error": STOP},
        {"next": "a", "expect": {**plain_of(POSE), "px": 3.5}},
        {"next": "a", "expect_error": STOP}]),
    Scenario("generators_with_parameter", [
        {"generate": "scale", "as": "s", "args": [{"double": 2.0}], "expect": None},
        {"next": "s", "value": {"double": 1.5}, "expect": 3.0},
        {"next": "s", "value": {"double": -4.0}, "expect": -8.0},
        {"close_generator": "s", "expect": None},
        {"next": "s", "value": {"double": 1.0}, "expect_error": STOP},
        {"generate": "collect", "as": "c", "expect": None},
        {"next": "c", "value": {"double[]": [1.0, 2.0]}, "expect": None},
        {"next": "c", "value": {"double[]": []}, "expect": None},
        {"next": "c", "value": {"double[]": [3.0]}, "expect": None},
        {"close_generator": "c", "expect": None},
        {"get": "collected", "expect": [1.0, 2.0, 3.0]}]),
    Scenario("generators_that_are_stopped", [
        {"generate": "count_up", "as": "c", "args": [{"double": 0.0}, {"int32": 1000000}], "expect": None},
        {"next": "c", "expect": 0.0},
        {"close_generator": "c", "expect": None},
        {"get": "generator_end", "expect": "closed"},
        {"next": "c", "expect_error": STOP},
        {"generate": "count_up", "as": "a", "args": [{"double": 7.0}, {"int32": 1000000}], "expect": None},
        {"next": "a", "expect": 7.0},
        {"abort_generator": "a", "expect": None},
        {"get": "generator_end", "expect": "aborted"},
        {"generate": "count_up", "as": "f", "args": [{"double": 1.0}, {"int32": -1}], "expect": None},
        {"next": "f", "expect": 1.0},
        {"next": "f", "expect_error": "RobotRaconteur.OutOfRange", "message": "no more"}]),
    # A generator of JavaScript does not ask the service again: after its end it says so itself.
    Scenario("generators_after_their_end", [
        {"generate": "count_up", "as": "a", "args": [{"double": 7.0}, {"int32": 1000000}], "expect": None},
        {"next": "a", "expect": 7.0},
        {"abort_generator": "a", "expect": None},
        {"next": "a", "expect_error": "RobotRaconteur.OperationAborted"},
        {"generate": "count_up", "as": "f", "args": [{"double": 1.0}, {"int32": -1}], "expect": None},
        {"next": "f", "expect": 1.0},
        {"next": "f", "expect_error": "RobotRaconteur.OutOfRange", "message": "no more"},
        {"next": "f", "expect_error": "RobotRaconteur.InvalidOperation"}], clients=NATIVE),
    Scenario("memories", [
        {"dimensions": "m_numbers", "expect": [100]},
        read("m_numbers", "double", [0], [4], [0.0, 1.0, 2.0, 3.0]),
        write("m_numbers", [97], {"double[]": [-1.0, -2.0, -3.0]}),
        read("m_numbers", "double", [96], [4], [96.0, -1.0, -2.0, -3.0]),
        {"dimensions": "m_vectors", "expect": [5]},
        read("m_vectors", "Vector3", [1], [2], [3.0, 4.0, 5.0, 6.0, 7.0, 8.0]),
        write("m_vectors", [4], {"Vector3[]": [0.5, 0.25, 0.125]}),
        read("m_vectors", "Vector3", [3], [2], [9.0, 10.0, 11.0, 0.5, 0.25, 0.125]),
        {"dimensions": "m_samples", "expect": [4]},
        read("m_samples", "Sample", [0], [1], [ZERO_SAMPLE]),
        write("m_samples", [1], {"Sample[]": [SAMPLE["Sample"], OTHER_SAMPLE["Sample"]]}),
        read("m_samples", "Sample", [0], [4], [ZERO_SAMPLE, plain_of(SAMPLE)[0], plain_of(OTHER_SAMPLE)[0], ZERO_SAMPLE]),
        read("m_fixed", "uint8", [7], [3], [7, 8, 9])]),
    Scenario("memories_of_dimensions", [
        {"dimensions": "m_grid", "expect": [4, 3, 2]},
        read("m_grid", "int16", [0, 0, 0], [4, 3, 2], {"dims": [4, 3, 2], "data": list(range(24))}),
        read("m_grid", "int16", [1, 0, 1], [2, 3, 1], {"dims": [2, 3, 1], "data": [13, 14, 17, 18, 21, 22]}),
        read("m_grid", "int16", [3, 2, 0], [1, 1, 2], {"dims": [1, 1, 2], "data": [11, 23]}),
        write("m_grid", [2, 1, 0], {"int16[*]": {"dims": [2, 2, 1], "data": [-1, -2, -3, -4]}}),
        read("m_grid", "int16", [0, 0, 0], [4, 3, 1],
             {"dims": [4, 3, 1], "data": [0, 1, 2, 3, 4, 5, -1, -2, 8, 9, -3, -4]}),
        read("m_vector_grid", "Vector3", [1, 1], [1, 2], {"dims": [1, 2], "data": [9.0, 10.0, 11.0, 15.0, 16.0, 17.0]}),
        write("m_vector_grid", [0, 2], {"Vector3[*]": {"dims": [2, 1], "data": [1.5] * 6}}),
        read("m_vector_grid", "Vector3", [0, 1], [1, 2], {"dims": [1, 2], "data": [6.0, 7.0, 8.0, 1.5, 1.5, 1.5]}),
        write("m_sample_grid", [0, 1], {"Sample[*]": {"dims": [2, 1], "data": [SAMPLE["Sample"], OTHER_SAMPLE["Sample"]]}}),
        read("m_sample_grid", "Sample", [1, 0], [1, 2], {"dims": [1, 2], "data": [ZERO_SAMPLE, plain_of(OTHER_SAMPLE)[0]]})]),
    # More than one request may carry, each way, from the beginning and from the middle of a dimension.
    Scenario("large_memories", [
        digest("m_large", "double", [0], [50000], {"count": 50000, "first": 0.0, "last": 49999.0, "sum": 1249975000.0}),
        write("m_large", [1000], {"ramp": 40000}),
        digest("m_large", "double", [999], [40002], {"count": 40002, "first": 999.0, "last": 41000.0, "sum": 800021999.0}),
        digest("m_volume", "single", [0, 0, 0], [60, 50, 40],
               {"count": 120000, "first": 0.0, "last": 119999.0, "sum": 7199940000.0}),
        digest("m_volume", "single", [10, 0, 1], [50, 50, 39],
               {"count": 97500, "first": 3010.0, "last": 119999.0, "sum": 5996688750.0}),
        write("m_volume", [0, 5, 3], {"single[*]": {"dims": [60, 40, 30], "data": [0.5] * 72000}}),
        digest("m_volume", "single", [0, 5, 3], [60, 40, 30], {"count": 72000, "first": 0.5, "last": 0.5, "sum": 36000.0}),
        read("m_volume", "single", [59, 4, 3], [1, 2, 1], {"dims": [1, 2, 1], "data": [9299.0, 0.5]}),
        read("m_volume", "single", [0, 44, 32], [1, 2, 2], {"dims": [1, 2, 2], "data": [0.5, 98700.0, 101640.0, 101700.0]})]),
    # The reference checks no ranges, neither as a client nor in a Python service.
    Scenario("memory_bounds", [
        read_fails("m_numbers", "double", [97], [4], OUTSIDE),
        read_fails("m_numbers", "double", [18446744073709551615], [2], OUTSIDE),
        read("m_numbers", "double", [100], [0], []),
        read_fails("m_grid", "int16", [0, 2, 0], [4, 2, 1], OUTSIDE),
        read_fails("m_grid", "int16", [0, 0], [1, 1], "RobotRaconteur.InvalidArgument"),
        {"write_memory": "m_numbers", "position": [99], "value": {"double[]": [1.0, 2.0]}, "expect_error": OUTSIDE},
        {"write_memory": "m_fixed", "position": [0], "value": {"uint8[]": [1]},
         "expect_error": "RobotRaconteur.ReadOnlyMember"}], clients=("ours", "javascript")),
]


def opened(name, username, password, service="guarded"):
    return {"open": name, "service": service, "username": username, "password": password, "expect": None}


AUTHENTICATION = "RobotRaconteur.AuthenticationError"
LOCKED = "RobotRaconteur.ObjectLockedError"

SCENARIOS += [
    Scenario("login", [
        {"open": "nobody", "service": "guarded", "expect_error": AUTHENTICATION},
        {"open": "wrong", "service": "guarded", "username": "alice", "password": "hunter2", "expect_error": AUTHENTICATION},
        {"open": "mallory", "service": "guarded", "username": "mallory", "password": "secret", "expect_error": AUTHENTICATION},
        opened("a", "alice", "secret"),
        opened("b", "bob", "hunter2"),
        {"by": "a", "call": "who", "expect": "alice"},
        {"by": "b", "call": "who", "expect": "bob"},
        {"by": "a", "set": "level", "value": {"double": 2.5}, "expect": None},
        {"by": "b", "get": "level", "expect": 2.5},
        {"by": "b", "on": ["head"], "call": "identify", "expect": "part head"},
        # A login within the connect request fails where no user is required.
        {"open": "o", "service": "open", "username": "alice", "password": "secret", "expect_error": AUTHENTICATION},
        {"open": "o", "service": "open", "expect": None},
        {"by": "o", "call": "who", "expect": ""},
        {"leave": "o", "expect": None}]),
    Scenario("user lock", [
        opened("a", "alice", "secret"),
        opened("b", "bob", "hunter2"),
        {"by": "b", "on": ["head"], "call": "identify", "expect": "part head"},
        {"by": "a", "lock": "user", "expect": None},
        {"by": "a", "set": "level", "value": {"double": 2.0}, "expect": None},
        {"by": "b", "get": "level", "expect_error": LOCKED, "message": "Object locked by alice"},
        {"by": "b", "set": "level", "value": {"double": 3.0}, "expect_error": LOCKED},
        {"by": "b", "call": "who", "expect_error": LOCKED},
        {"by": "b", "on": ["head"], "get": "size", "expect_error": LOCKED},
        {"by": "b", "connect": "position", "expect_error": LOCKED},
        {"by": "b", "peek_in": "position", "expect_error": LOCKED},
        {"by": "b", "get": "shown", "expect": 0.0},  # nolockread
        {"by": "b", "set": "shown", "value": {"double": 3.0}, "expect_error": LOCKED},
        {"by": "b", "get": "status", "expect": 7},  # nolock
        {"by": "b", "set": "status", "value": {"int32": 8}, "expect": None},
        {"by": "b", "set": "status", "value": {"int32": 7}, "expect": None},
        {"by": "b", "connect": "free_position", "expect": None},
        {"by": "b", "close": "free_position", "expect": None},
        {"by": "b", "lock": "user", "expect_error": LOCKED, "message": "Object already locked"},
        {"by": "b", "unlock": "object", "expect_error": LOCKED},
        opened("a2", "alice", "secret"),
        {"by": "a2", "get": "level", "expect": 2.0},
        {"by": "a", "unlock": "object", "expect": None},
        {"by": "b", "get": "level", "expect": 2.0},
        {"by": "b", "set": "level", "value": {"double": 1.5}, "expect": None}]),
    Scenario("lock of a child", [
        opened("a", "alice", "secret"),
        opened("b", "bob", "hunter2"),
        {"by": "b", "on": [["parts", 1]], "call": "identify", "expect": "part number 1"},
        {"by": "a", "on": [["parts", 1]], "lock": "user", "expect": None},
        {"by": "b", "on": [["parts", 1]], "call": "identify", "expect_error": LOCKED},
        {"by": "b", "call": "who", "expect": "bob"},
        {"by": "b", "on": ["head"], "call": "identify", "expect": "part head"},
        {"by": "b", "lock": "user", "expect_error": LOCKED},
        # The last session of its user ends: so does the lock.
        {"leave": "a", "expect": None},
        {"by": "b", "on": [["parts", 1]], "call": "identify", "expect": "part number 1"}]),
    Scenario("client lock", [
        opened("a", "alice", "secret"),
        opened("a2", "alice", "secret"),
        opened("r", "root", "toor"),
        {"by": "a", "lock": "client", "expect": None},
        {"by": "a", "call": "who", "expect": "alice"},
        {"by": "a2", "get": "level", "expect_error": LOCKED},
        {"by": "r", "get": "level", "expect_error": LOCKED},
        {"by": "r", "unlock": "object", "expect": None},
        {"by": "a2", "call": "who", "expect": "alice"},
        {"by": "a", "lock": "client", "expect": None},
        {"leave": "a", "expect": None},
        {"by": "a2", "call": "who", "expect": "alice"}]),
    Scenario("lock refused", [
        opened("g", "guest", "secret"),
        {"by": "g", "lock": "user", "expect_error": LOCKED},
        {"by": "g", "call": "who", "expect": "guest"},
        {"open": "o", "service": "open", "expect": None},
        {"by": "o", "lock": "user", "expect_error": AUTHENTICATION}]),
    Scenario("monitor", services=("ours",), steps=[  # Python services cannot
        {"open": "first", "service": "open", "expect": None},
        {"open": "second", "service": "open", "expect": None},
        {"by": "first", "enter": "m1", "timeout": -1, "expect": None},
        {"by": "first", "get": "level", "expect": 1.5},
        {"by": "second", "get": "level", "expect_error": "RobotRaconteur.InvalidOperation"},
        {"by": "second", "enter": "m2", "timeout": 10, "expect_error": "RobotRaconteur.OperationTimeout"},
        {"by": "first", "exit": "m1", "expect": None},
        {"by": "second", "enter": "m2", "timeout": 1000, "expect": None},
        {"by": "first", "get": "level", "expect_error": "RobotRaconteur.InvalidOperation"},
        {"leave": "second", "expect": None},
        {"by": "first", "get": "level", "expect": 1.5}]),
    Scenario("monitor that is waited for", clients=("javascript",), services=("ours",), steps=[  # the others wait in turn
        {"open": "first", "service": "open", "expect": None},
        {"open": "second", "service": "open", "expect": None},
        {"by": "first", "enter": "m1", "timeout": -1, "expect": None},
        {"by": "second", "enter": "m2", "timeout": -1, "later": True, "expect": None},
        {"by": "first", "get": "level", "expect": 1.5},
        {"by": "first", "exit": "m1", "expect": None},
        {"by": "second", "entered": "m2", "expect": None},
        {"by": "second", "get": "level", "expect": 1.5},
        {"by": "first", "get": "level", "expect_error": "RobotRaconteur.InvalidOperation"},
        {"by": "first", "enter": "m1", "timeout": 50, "later": True, "expect": None},
        {"by": "first", "entered": "m1", "expect_error": "RobotRaconteur.OperationTimeout"},
        {"by": "second", "exit": "m2", "expect": None},
        {"by": "first", "get": "level", "expect": 1.5}]),
    Scenario("login later", clients=("ours", "javascript"), steps=[  # the reference's Python client cannot
        {"open": "o", "service": "open", "expect": None},
        {"by": "o", "login": "alice", "password": "hunter2", "expect_error": AUTHENTICATION},
        {"by": "o", "login": "bob", "password": "hunter2", "expect": None},
        {"by": "o", "call": "who", "expect": "bob"},
        {"by": "o", "logout": "now", "expect": None},
        {"by": "o", "get": "level", "expect": 1.5},
        {"by": "o", "call": "who", "expect": ""}]),
]

SCENARIO = {scenario.name: scenario for scenario in SCENARIOS}
FUNCTIONS = SCENARIO["functions"]
