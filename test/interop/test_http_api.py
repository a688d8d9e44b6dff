"""The objects of a device over plain HTTP, as curl would use them; the device is the reference and ours in turn."""
import base64
import functools
import http.client
import json
import socket
import struct
import sys
import threading
import time

import pytest

from directions import DIRECTIONS, PEERS, service_command
import http_api
from http_api import BASE, schemathesis
from processes import BUILD, Background, start_gateway

ask = functools.partial(http_api.ask, base=BASE)
Stream = functools.partial(http_api.Stream, base=BASE)
UPGRADE = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
           "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}


def test_a_page_that_was_loaded_by_a_strangers_name_moves_nothing(gateway):
    """DNS rebinding: the stranger's name now leads here, and his page is to its browser one of the gateway's own."""
    page = {"Host": f"evil.example:{gateway}", "Origin": f"http://evil.example:{gateway}"}
    for method, path, body, headers in [
            ("GET", "/p_double", None, {"Host": page["Host"]}), ("PUT", "/p_double", 6.5, page),
            ("POST", "/add", {"left": 1, "right": 2}, page), ("GET", "/changed", None, {**page, "Accept": "text/event-stream"}),
            ("GET", "", None, {**page, **UPGRADE}), ("GET", "", None, {**page, **UPGRADE, "Sec-WebSocket-Protocol": "rrgate.json.v1"})]:
        refused = ask(gateway, method, path, body, headers)
        assert refused.status == 421, (method, path, refused.body)
        assert "allowed_hosts" in refused.json["detail"]
    for protocol in ({}, {"Sec-WebSocket-Protocol": "robotraconteur.robotraconteur.com"}):
        assert http_api.ask(gateway, "GET", "/devices/interop", headers={**page, **UPGRADE, **protocol}).status == 421
    assert ask(gateway, "GET", "/p_double").json != 6.5


def test_what_another_sites_page_embeds_reads_nothing(gateway):
    assert ask(gateway, "GET", "/p_double", headers={"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}).status == 403
    assert ask(gateway, "GET", "/p_double", headers={"Sec-Fetch-Site": "same-origin", "Sec-Fetch-Mode": "cors"}).status == 200


def test_properties(gateway):
    assert ask(gateway, "PUT", "/p_double", 2.5).status == 204
    assert ask(gateway, "GET", "/p_double").json == 2.5
    assert ask(gateway, "PUT", "/p_int64", "9007199254740993").status == 204
    assert ask(gateway, "GET", "/p_int64").json == "9007199254740993"
    pose = {"px": 1, "py": -0.5, "label": "grün"}
    assert ask(gateway, "PUT", "/p_pose", pose).status == 204
    assert ask(gateway, "GET", "/p_pose").json == pose
    assert ask(gateway, "PUT", "/p_color", "green").status == 204
    assert ask(gateway, "GET", "/p_color").json == "green"
    assert ask(gateway, "GET", "/p_color?enums=number").json == 2
    assert ask(gateway, "PUT", "/p_doubles", [1, "NaN"]).status == 204
    assert ask(gateway, "GET", "/p_doubles?arrays=packed").json["count"] == 2
    assert ask(gateway, "HEAD", "/p_double").body == b""
    assert ask(gateway, "GET", "/version").json == "1"


def test_what_is_refused(gateway):
    def refusal(status, detail, *request, **more):
        answer = ask(gateway, *request, **more)
        assert (answer.status, answer.headers["Content-Type"]) == (status, "application/problem+json"), answer.body
        assert detail in answer.json["detail"]
        return answer

    refusal(404, "no member 'nope'", "GET", "/nope")
    refusal(404, "no device", "GET", "", base="/api/v1/devices/other/x")
    refusal(404, "", "GET", "", base="/api/v1/devices/interop/other")
    refusal(400, "read 'p_double': found a string", "PUT", "/p_double", "1")
    refusal(400, "twice", "PUT", "/p_pose", b'{"px":1,"px":2}', headers={"Content-Type": "application/json"})
    refusal(400, "Content-Type", "PUT", "/p_double", b"1", headers={"Content-Type": "text/plain"})
    assert refusal(405, "GET, HEAD", "PUT", "/version", "2").headers["Allow"] == "GET, HEAD"
    assert refusal(405, "PUT", "GET", "/secret").headers["Allow"] == "PUT"
    refusal(405, "POST", "GET", "/add")
    refusal(400, "misses the parameter 'right' (double)", "POST", "/add", {"left": 1})
    refusal(400, "no parameter 'up'", "POST", "/add", {"left": 1, "right": 2, "up": 3})
    refusal(404, "needs an index", "GET", "/parts")
    refusal(404, "", "GET", "/parts/99/size")
    refusal(404, "nothing is below it", "GET", "/p_double/x")
    refusal(406, "text/event-stream", "GET", "/changed")
    for path in ("/changed", "/poses"):
        assert refusal(405, "GET, HEAD", "POST", path, {}).headers["Allow"] == "GET, HEAD"
    refusal(406, "text/event-stream", "GET", "/doubled")
    refusal(501, "only receive", "POST", "/doubled", 1.0)
    refusal(501, "WebSocket", "POST", "/ask", {})
    for accept in ("application/json", "text/event-stream", "multipart/x-mixed-replace"):
        refusal(501, "only be sent to", "GET", "/taken", headers={"Accept": accept})
    assert refusal(405, "PUT", "GET", "/target", headers={"Accept": "text/event-stream"}).headers["Allow"] == "PUT"
    refusal(501, "WebSocket", "POST", "/scale", {"factor": 2})
    refusal(403, "origin", "GET", "/p_double", headers={"Origin": "http://elsewhere.example"})
    error = refusal(422, "out of jam", "POST", "/fail", {"kind": "custom", "text": "out of jam"}).json["error"]
    assert error == {"name": "experimental.interop.InteropError", "message": "out of jam"}
    refusal(400, "too far", "POST", "/fail", {"kind": "out_of_range", "text": "too far"})


def test_functions(gateway):
    assert ask(gateway, "POST", "/add", {"left": 1, "right": 2.5}).json == {"result": 3.5}
    assert ask(gateway, "POST", "/nothing").json == {"result": None}
    assert ask(gateway, "POST", "/nothing", {}).json == {"result": None}
    assert ask(gateway, "POST", "/join", {"words": ["a", "b"], "separator": "-"}).json == {"result": "a-b"}
    echoed = ask(gateway, "POST", "/echo", {"value": {"type": "int16[]", "value": [1, 2]}}).json
    assert echoed == {"result": {"type": "int16[]", "value": [1, 2]}}
    values = list(range(300_000))
    assert ask(gateway, "POST", "/sum", {"values": values}).json == {"result": sum(values)}
    assert ask(gateway, "POST", "/ramp", {"count": 200_000}).json["result"][-1] == 199_999


def test_objects(gateway):
    assert ask(gateway, "GET", "/head/name").json == "head"
    assert ask(gateway, "GET", "/head/inner/name").json == "head.inner"
    assert ask(gateway, "GET", "/parts/7/name").json == "number 7"
    assert ask(gateway, "GET", "/named/right%20hand/name").json == "named right hand"
    assert ask(gateway, "GET", "/named/a.b/name").json == "named a.b"
    assert ask(gateway, "GET", "/anything/feature").json == "none"
    assert ask(gateway, "POST", "/head/identify").json == {"result": "part head"}
    described = ask(gateway, "GET", "").json
    assert described["type"] == "experimental.interop.Interop"
    assert {"name": "version", "kind": "property", "type": "string", "direction": "readonly"} in described["members"]


def test_a_large_document_keeps_nobody_waiting(gateway):
    """Values of 8 MB, as JSON of 5 MB: they are read, made values of, made of values and freed beside the gateway's thread."""
    numbers = json.dumps([1.5] * 1_000_000).encode()
    header = {"Content-Type": "application/json"}

    def share_of_longest(method, body, status):
        """How much of the time that it took somebody else waited for one answer."""
        large = threading.Thread(target=lambda: answers.append(ask(gateway, method, "/p_doubles", body, headers=header)))
        answers, longest, begin = [], 0, time.monotonic()
        large.start()
        while large.is_alive():
            asked = time.monotonic()
            assert http_api.ask(gateway, "GET", "/healthz").status == 200
            longest = max(longest, time.monotonic() - asked)
        assert answers[0].status == status
        return longest / (time.monotonic() - begin)

    asked = [("PUT", numbers, 204), ("GET", None, 200), ("PUT", b'{"no": ' + numbers + b"}", 400)]
    # The machine may be busy with something else, but not each time.
    shares = {f"{method} {status}": min(share_of_longest(method, body, status) for _ in range(8)) for method, body, status in asked}
    ask(gateway, "PUT", "/p_doubles", [])
    assert max(shares.values()) < 0.15, shares


def test_memories(gateway):
    assert ask(gateway, "GET", "/m_numbers/shape").json == [100]
    assert ask(gateway, "GET", "/m_numbers?offset=3&count=2").json == [3, 4]
    assert ask(gateway, "PUT", "/m_numbers?offset=3", [30, 40]).status == 204
    assert ask(gateway, "GET", "/m_numbers?offset=2&count=4").json == [2, 30, 40, 5]
    assert ask(gateway, "GET", "/m_grid?offset=0,1,0&count=4,1,1").json == {"dims": [4, 1, 1], "data": [4, 5, 6, 7]}
    whole = ask(gateway, "GET", "/m_fixed", headers={"Accept": "application/octet-stream"})
    assert whole.body == bytes(range(10)) and whole.headers["Accept-Ranges"] == "bytes"
    part = ask(gateway, "GET", "/m_fixed", headers={"Accept": "application/octet-stream", "Range": "bytes=2-4"})
    assert (part.status, part.body, part.headers["Content-Range"]) == (206, bytes([2, 3, 4]), "bytes 2-4/10")
    tail = ask(gateway, "GET", "/m_fixed", headers={"Accept": "application/octet-stream", "Range": "bytes=-3"})
    assert tail.body == bytes([7, 8, 9])
    ranged = {"Accept": "application/octet-stream", "Range": "bytes=2-4"}
    changed = ask(gateway, "GET", "/m_fixed", headers={**ranged, "If-Range": '"abc"'})
    assert (changed.status, changed.body) == (200, bytes(range(10)))
    head = ask(gateway, "HEAD", "/m_fixed", headers=ranged)
    assert (head.status, head.headers["Content-Length"]) == (200, "10")
    beyond = ask(gateway, "GET", "/m_fixed", headers={"Accept": "application/octet-stream", "Range": "bytes=10-"})
    assert (beyond.status, beyond.headers["Content-Range"]) == (416, "bytes */10")
    within = ask(gateway, "GET", "/m_large", headers={"Accept": "application/octet-stream", "Range": "bytes=9-16"})
    assert within.status == 206 and len(within.body) == 8
    part = ask(gateway, "GET", "/m_fixed?offset=7&count=2", headers={"Accept": "application/octet-stream"})
    assert (part.status, part.body, part.headers["Cache-Control"]) == (200, bytes([7, 8]), "no-store")
    rest = ask(gateway, "GET", "/m_fixed?offset=7", headers={"Accept": "application/octet-stream"})
    assert (rest.status, rest.body) == (200, bytes([7, 8, 9]))
    first = ask(gateway, "GET", "/m_large?count=1", headers={"Accept": "application/octet-stream"})
    assert (first.status, first.body) == (200, bytes(8))
    assert ask(gateway, "GET", "/m_fixed?count=11", headers={"Accept": "application/octet-stream"}).status == 400
    assert ask(gateway, "GET", "/m_large").json[-1] == 49_999
    assert ask(gateway, "GET", "/m_numbers?offset=1,2").status == 400
    assert ask(gateway, "GET", "/m_numbers?offset=99&count=2").status == 400
    assert ask(gateway, "PUT", "/m_fixed", "AA==").status == 405


def test_a_part_of_a_memory_is_written_where_the_request_says_or_not_at_all(gateway):
    ask(gateway, "PUT", "/m_numbers", [1, 2, 3, 4])
    ranged = ask(gateway, "PUT", "/m_numbers", [9, 9], {"Content-Range": "bytes 16-31/800"})
    assert ranged.status == 400 and "offset" in ranged.json["detail"]
    assert ask(gateway, "PUT", "/p_double", 9, {"Content-Range": "bytes 0-7/8"}).status == 400
    numbers = {"Content-Type": "application/octet-stream"}
    for encoding in ("gzip", "identity, br"):
        packed = ask(gateway, "PUT", "/m_numbers", bytes(16), {**numbers, "Content-Encoding": encoding})
        assert packed.status == 415 and encoding in packed.json["detail"]
    for conditions in ({"If-Match": '"x"'}, {"If-Match": 'W/"x", "y"'}, {"If-None-Match": "*"}):
        for path, value in (("/m_numbers", [9, 9]), ("/p_double", 9)):
            assert ask(gateway, "PUT", path, value, conditions).status == 412
        assert ask(gateway, "PUT", "/m_fixed", [9], conditions).status == 405  # as without them
    longer = ask(gateway, "PUT", "/m_numbers?offset=1&count=1", [9, 9, 9])
    assert (longer.status, longer.json["error"]["name"]) == (400, "RobotRaconteur.InvalidArgument")
    assert "3 items" in longer.json["detail"]
    assert ask(gateway, "PUT", "/m_grid?offset=0,0,0&count=4,1,1", {"dims": [2, 2, 1], "data": [0, 0, 0, 0]}).status == 400
    assert ask(gateway, "GET", "/m_numbers?count=4").json == [1, 2, 3, 4]
    assert ask(gateway, "PUT", "/m_numbers?offset=1&count=2", [20, 30], {"Range": "bytes=0-7"}).status == 204  # it is of GET alone
    assert ask(gateway, "GET", "/m_numbers?count=4").json == [1, 20, 30, 4]
    assert ask(gateway, "PUT", "/m_numbers", [1, 20], {"If-Match": "*"}).status == 204
    assert ask(gateway, "PUT", "/m_numbers", [1, 20], {"If-None-Match": '"x"'}).status == 204
    assert ask(gateway, "PUT", "/m_numbers", struct.pack("<d", 5), {**numbers, "Content-Encoding": "identity"}).status == 204
    assert ask(gateway, "GET", "/m_numbers?count=2").json == [5, 20]


def test_what_is_too_large_for_a_message_is_not_sent_and_said_to_be_that(gateway):
    ask(gateway, "PUT", "/p_string", "short")
    large = ask(gateway, "PUT", "/p_string", "x" * 13_000_000)
    assert (large.status, large.json["error"]["name"]) == (413, "RobotRaconteur.BufferLimitViolation")
    assert "bytes, limit " in large.json["detail"]
    assert ask(gateway, "GET", "/p_string").json == "short"


def test_a_memory_of_pods_is_read_in_parts(tmp_path):
    device = Background([sys.executable, PEERS / "many_samples.py"], tmp_path / "device.log")
    process, port = start_gateway(tmp_path, json.loads(device.next_line())["url"])
    try:
        memory = "/api/v1/devices/interop/device/samples"
        whole = http_api.ask(port, "GET", memory)
        assert (whole.status, whole.json["error"]["name"]) == (413, "RobotRaconteur.BufferLimitViolation")
        part = http_api.ask(port, "GET", memory + "?offset=79998&count=2")
        assert (part.status, part.json) == (200, [{"id": 0, "reading": [0] * 16}] * 2)
    finally:
        process.stop()
        device.stop()


def test_wires_as_values(gateway):
    assert ask(gateway, "PUT", "/target", 4.5).status == 204
    assert ask(gateway, "GET", "/seen_target").json == 4.5
    assert ask(gateway, "POST", "/publish_state", {"value": [1, 2]}).status == 200
    assert ask(gateway, "GET", "/state").json == [1, 2]


def test_wires_as_streams(gateway):
    """Two readers of one wire; the one who comes later gets the newest value at once."""
    ask(gateway, "POST", "/publish_state", {"value": [1]})
    first = Stream(gateway, "/state")
    for number in range(2, 5):
        ask(gateway, "POST", "/publish_state", {"value": [number]})
    while first.next()[2] != [4]:
        pass
    second = Stream(gateway, "/state")
    assert second.next()[2] == [4]
    ask(gateway, "POST", "/publish_state", {"value": [5]})
    assert (first.next()[2], second.next()[2]) == ([5], [5])
    first.close()
    second.close()


def test_events_with_resume(gateway):
    stream = Stream(gateway, "/changed")
    ask(gateway, "POST", "/fire", {"count": 3})
    seen = [stream.next() for _ in range(3)]
    assert sorted(data["value"] for _, _, data in seen) == [0, 1, 2]
    assert all(data["why"] == f"number {data['value']:.0f}" for _, _, data in seen)
    last = seen[0][0]
    stream.close()
    ask(gateway, "POST", "/fire", {"count": 1})
    time.sleep(0.3)  # nobody listens: it is kept
    again = Stream(gateway, "/changed", {"Last-Event-ID": last})
    assert [again.next()[0] for _ in range(3)] == [str(int(last) + i) for i in (1, 2, 3)]
    again.close()


def test_pipes(gateway):
    stream = Stream(gateway, "/greetings")
    assert [stream.next()[2] for _ in range(2)] == ["hello", "world"]
    stream.close()


def test_generators(gateway):
    def lines(path, body):
        answer = ask(gateway, "POST", path, body)
        assert answer.headers["Content-Type"] == "application/x-ndjson"
        return [json.loads(line) for line in answer.body.splitlines()]

    assert lines("/count_up", {"first": 5, "count": 3}) == [5, 6, 7]
    failed = lines("/count_up", {"first": 5, "count": -2})
    assert failed[:2] == [5, 6] and failed[2]["error"]["name"] == "RobotRaconteur.OutOfRange"


def test_a_reader_who_leaves_ends_its_generator(gateway):
    connection = http.client.HTTPConnection("127.0.0.1", gateway, timeout=20)
    connection.request("POST", BASE + "/count_up", json.dumps({"first": 0, "count": 2_000_000_000}),
                       {"Content-Type": "application/json"})
    response = connection.getresponse()
    assert response.readline() == b"0.0\n"
    response.close()
    connection.close()
    deadline = time.monotonic() + 10
    while ask(gateway, "GET", "/generator_end").json != "closed":
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_users_of_the_device(gateway):
    def level(user, password, port=gateway):
        credentials = base64.b64encode(f"{user}:{password}".encode()).decode()
        return ask(port, "GET", "/level", headers={"Authorization": "Basic " + credentials},
                   base="/api/v1/devices/interop/guarded")

    refused = ask(gateway, "GET", "/level", base="/api/v1/devices/interop/guarded")
    assert refused.status in (401, 403) and refused.json["error"]["name"].startswith("RobotRaconteur."), refused.body
    assert level("alice", "wrong").status in (401, 403)
    assert level("alice", "secret").json == 1.5


def test_cbor(gateway):
    ask(gateway, "PUT", "/p_doubles", [1.5])
    answer = ask(gateway, "GET", "/p_doubles", headers={"Accept": "application/cbor"})
    assert answer.headers["Content-Type"] == "application/cbor"
    assert answer.body.hex() == "d85648000000000000f83f"  # RFC 8746: typed array of little-endian doubles
    assert ask(gateway, "PUT", "/p_doubles", bytes.fromhex("d856480000000000000040"),
               headers={"Content-Type": "application/cbor"}).status == 204
    assert ask(gateway, "GET", "/p_doubles").json == [2.0]


@pytest.mark.parametrize("accept, kind", [
    ("application/cbor;q=0, application/json", "json"), ("application/json, application/cbor; q=0.000", "json"),
    ("application/octet-stream;q=0, application/json", "json"), ("application/cbor-seq, application/json", "json"),
    ("text/event-stream;q=0", "json"), ("Application/CBOR", "cbor"), ("application/cbor;v=1;q=0.5", "cbor"),
    ("text/html\r\nAccept: application/cbor", "cbor"), ("*/*", "json")])
def test_the_form_of_an_answer_is_one_that_is_accepted(gateway, accept, kind):
    ask(gateway, "POST", "/publish_state", {"value": [1]})
    with socket.create_connection(("127.0.0.1", gateway), 20) as link:
        link.sendall(f"GET {BASE}/state HTTP/1.1\r\nHost: localhost\r\nAccept: {accept}\r\n\r\n".encode())
        answer = http.client.HTTPResponse(link)
        answer.begin()
        assert answer.headers["Content-Type"] == "application/" + kind
        answer.close()


def test_streams_are_text_also_for_readers_of_cbor(gateway):
    ask(gateway, "POST", "/publish_state", {"value": [1.5, 2]})
    stream = Stream(gateway, "/state", {"Accept": "text/event-stream, application/cbor"})
    assert stream.next()[2] == [1.5, 2]
    stream.close()


def test_cbor_whose_text_is_not_utf8_is_refused(gateway):
    cbor = {"Content-Type": "application/cbor"}
    assert ask(gateway, "PUT", "/p_string", "grün").status == 204
    assert ask(gateway, "PUT", "/p_string_map", {"grün": "yes"}).status == 204
    for path, body in (("/p_string", b"\x61\xfc"), ("/p_string_map", b"\xa1\x61\xfc\x61a"), ("/p_string_map", b"\xa1\x61a\x61\xfc")):
        refused = ask(gateway, "PUT", path, body, cbor)
        assert refused.status == 400 and "not UTF-8" in refused.json["detail"], refused.body
    assert ask(gateway, "GET", "/p_string").json == "grün"
    assert ask(gateway, "GET", "/p_string_map").json == {"grün": "yes"}
    assert ask(gateway, "PUT", "/p_string", b"\x62\xc3\xbc", cbor).status == 204
    assert ask(gateway, "GET", "/p_string").json == "ü"


def test_documents(gateway):
    base = "/api/v1/devices/interop"
    answer = ask(gateway, "GET", "/openapi.json", base=base)
    document = answer.json
    assert document["openapi"] == "3.1.0"
    assert "put" in document["paths"][BASE + "/p_pose"] and "put" not in document["paths"][BASE + "/version"]
    assert BASE + "/parts/{parts}/inner/name" not in document["paths"]  # a Part within a Part: listed once
    assert BASE + "/parts/{parts}/name" in document["paths"]
    assert document["components"]["schemas"]["experimental.interop.Pose"]["required"] == ["px", "py", "label"]
    again = ask(gateway, "GET", "/openapi.json", base=base, headers={"If-None-Match": answer.headers["ETag"]})
    assert (again.status, again.body) == (304, b"")
    asynchronous = ask(gateway, "GET", "/asyncapi.json", base=base).json
    assert asynchronous["channels"]["interop_changed"]
    assert asynchronous["channels"]["socket_interop"]["address"] == BASE
    assert "callback" in asynchronous["channels"]["socket_interop"]["messages"]["question"]["payload"]["properties"]
    description = ask(gateway, "GET", "/thing-description.json", base=base)
    assert [dangling(told.json) for told in (answer, description)] == [[], []] and dangling(asynchronous) == []
    assert "#/schemaDefinitions/experimental.interop.Pose" in references(description.json)
    assert description.json["actions"]["interop_add"]["forms"][0]["href"] == BASE + "/add"
    assert b"interface Interop" in ask(gateway, "GET", "/types.d.ts", base=base).body
    definition = ask(gateway, "GET", "/experimental.interop.robdef", base=base)
    assert definition.body.startswith(b"#") or b"service experimental.interop" in definition.body
    assert ask(gateway, "GET", "/nope.robdef", base=base).status == 404


def references(value):
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    own = [value["$ref"]] if isinstance(value, dict) and isinstance(value.get("$ref"), str) else []
    return own + [reference for each in inner for reference in references(each)]


def dangling(document):
    """References of a document that lead to nothing in it."""
    def leads_somewhere(reference):
        part = document
        for key in reference.removeprefix("#/").split("/"):
            part = part.get(key.replace("~1", "/").replace("~0", "~")) if isinstance(part, dict) else None
        return part is not None

    assert references(document)
    return [reference for reference in references(document) if not leads_somewhere(reference)]


def test_a_hundred_readers_are_one_client_of_the_device(gateway):
    def clients():
        return ask(gateway, "GET", "", base="/api/v1/devices").json["devices"][0]["clients"]

    ask(gateway, "GET", "/version")
    before = clients()
    streams = [Stream(gateway, "/state") for _ in range(100)]
    assert clients() == before
    ask(gateway, "POST", "/publish_state", {"value": [77]})

    def read(stream):
        while stream.next()[2] != [77]:
            pass

    threads = [threading.Thread(target=read, args=(stream,)) for stream in streams]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
        assert not thread.is_alive()
    for stream in streams:
        stream.close()


def test_streams_outlive_the_device(tmp_path):
    """A device of its own, which goes and comes back on the same port."""
    direction = next(each for each in DIRECTIONS if each.name == "reference-to-ours")
    service = Background(service_command(direction, "v4", "http://localhost"), tmp_path / "service.log")
    url = json.loads(service.next_line())["url"]
    process, port = start_gateway(tmp_path, url)
    try:
        ask(port, "POST", "/publish_state", {"value": [1]})
        stream = Stream(port, "/state")
        assert stream.next()[2] == [1]
        service.stop()
        assert stream.next()[1:] == ("state", {"state": "connection_lost", "detail": "connection_lost: device 'interop': the service was closed"})
        number = url.split(":")[2].split("/")[0]
        service = Background([*service_command(direction, "v4", "http://localhost"),
                              f"--robotraconteur-tcp-port={number}"], tmp_path / "again.log")
        service.next_line()
        while True:
            _, event, data = stream.next()
            if event == "state" and data["state"] == "connected":
                break
        ask(port, "POST", "/publish_state", {"value": [2]})
        while stream.next()[2] != [2]:
            pass
        stream.close()
    finally:
        process.stop()
        service.stop()


def test_gateway_and_device_keep_what_their_openapi_says(tmp_path):
    """The demo robot, and the gateway to it."""
    robot = Background([BUILD / "examples/demo/rrgate-demo-create", "--port", "0"], tmp_path / "robot.log")
    gateway, port = start_gateway(tmp_path, robot.next_line().split(" ", 1)[1])
    try:
        assert "15 selected" in schemathesis(tmp_path, port, "/api/v1/devices/interop/openapi.json")
        whole = ask(port, "GET", "/api/v1/openapi.json", base="").json
        operations = sum(len(item.keys() - {"parameters"}) for item in whole["paths"].values())
        assert f" {operations - 1} selected" in schemathesis(tmp_path, port, "/api/v1/openapi.json")  # all but itself
        longest = "/api/v1/audit?limit=" + "9" * 9000
        assert ask(port, "GET", longest, base="").status == 431
        assert "431" in whole["paths"]["/api/v1/audit"]["get"]["responses"]
        assert whole["tags"] == [{"name": "interop", "externalDocs": {"url": "/api/v1/devices/interop/openapi.json"}}]
        paths = ask(port, "GET", whole["tags"][0]["externalDocs"]["url"], base="").json["paths"]
        told = [operation["description"] for item in paths.values() for operation in item.values() if "description" in operation]
        assert told and not any(line.startswith(" ") for text in told for line in text.splitlines())
    finally:
        gateway.stop()
        robot.stop()


def test_pages_of_other_origins_use_what_is_allowed_to_them(device, tmp_path):
    process, port = start_gateway(tmp_path, device, "https://page.example")
    page, stranger = {"Origin": "https://page.example"}, {"Origin": "https://stranger.example"}
    try:
        for path, status in (("/p_double", 200), ("/nope", 404)):  # what failed can be read too
            answer = ask(port, "GET", path, headers=page)
            assert answer.status == status
            assert answer.headers["Access-Control-Allow-Origin"] == page["Origin"]
            assert "Origin" in answer.headers["Vary"]
        # What a browser asks before it sends anything but plain requests.
        asks = {"Access-Control-Request-Method": "PUT", "Access-Control-Request-Headers": "authorization, content-type"}
        leave = ask(port, "OPTIONS", "/p_double", headers={**page, **asks})
        assert (leave.status, leave.headers["Access-Control-Allow-Origin"]) == (204, page["Origin"])
        assert {"GET", "HEAD", "PUT", "POST"} <= set(leave.headers["Access-Control-Allow-Methods"].split(", "))
        allowed = {name.lower() for name in leave.headers["Access-Control-Allow-Headers"].split(", ")}
        assert {"accept", "authorization", "content-type", "last-event-id", "range"} <= allowed
        assert int(leave.headers["Access-Control-Max-Age"]) > 0
        assert ask(port, "PUT", "/p_double", 2.5, page).status == 204
        stream = Stream(port, "/changed", page)
        assert stream.response.headers["Access-Control-Allow-Origin"] == page["Origin"]
        stream.close()

        for method, path in (("GET", "/api/v1/devices"), ("POST", "/api/v1/tickets")):
            answer = ask(port, method, path, headers=page, base="")
            assert answer.status in (200, 201) and answer.headers["Access-Control-Allow-Origin"] == page["Origin"]
            leave = ask(port, "OPTIONS", path, headers={**page, **asks}, base="")
            assert leave.status == 204 and "Authorization" in leave.headers["Access-Control-Allow-Headers"]
        for path in ("/api/v1/access", "/api/v1/recordings", "/metrics", "/api/v1/devicesx"):  # not theirs
            answer = ask(port, "GET", path, headers=page, base="")
            assert not [name for name in answer.headers if name.lower().startswith("access-control-")], path

        for method, body in (("GET", None), ("PUT", 7.5), ("OPTIONS", None)):
            refused = ask(port, method, "/p_double", body, {**stranger, **(asks if method == "OPTIONS" else {})})
            assert refused.status == 403 and "allowed_origins" in refused.json["detail"], method
            assert not [name for name in refused.headers if name.lower().startswith("access-control-")]
        plain = ask(port, "GET", "/p_double")  # of no page
        assert plain.json == 2.5 and "Access-Control-Allow-Origin" not in plain.headers
    finally:
        process.stop()


def test_a_trace_goes_into_the_log(tmp_path):
    direction = next(each for each in DIRECTIONS if each.name == "reference-to-ours")
    service = Background(service_command(direction, "v4", "http://localhost"), tmp_path / "service.log")
    process, port = start_gateway(tmp_path, json.loads(service.next_line())["url"])
    try:
        trace = "4bf92f3577b34da6a3ce929d0e0e4736"
        parent = f"00-{trace}-00f067aa0ba902b7-01"
        answer = ask(port, "GET", "/version", headers={"traceparent": parent})
        assert answer.headers["traceparent"] == parent
        assert ask(port, "GET", "/version", headers={"traceparent": "00-nonsense"}).headers["traceparent"] is None

        def lines_of_calls():
            return [line for line in (tmp_path / "gateway.log").read_text().splitlines() if " call " in line]
        process.wait_until(lines_of_calls)  # they may come behind the answer
        lines = lines_of_calls()
        assert len(lines) == 1 and f"trace={trace}" in lines[0] and "device=interop" in lines[0]
        assert f"member={BASE}/version" in lines[0] and " us=" in lines[0]
    finally:
        process.stop()
        service.stop()
