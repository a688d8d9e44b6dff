"""The objects of a device as JSON over a WebSocket, as a page would use them; the device is the reference and ours in
turn."""
import base64
import functools
import json
import socket
import struct
import threading
import time

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from directions import DIRECTIONS, service_command
from http_api import BASE, JSON_PROTOCOL
import http_api
from json_sockets import Socket
from processes import Background, start_gateway
from shared_sites import Site, start_service
from tap import Held

ask = functools.partial(http_api.ask, base=BASE)


@pytest.fixture
def page(gateway):
    with Socket(gateway) as made:
        yield made


def wait_until(is_so):
    deadline = time.monotonic() + 15
    while not is_so():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_values_and_calls(page):
    assert page.socket.subprotocol == JSON_PROTOCOL
    assert page.ask("set", "p_double", value=2.5) is None
    assert page.ask("get", "p_double") == 2.5
    assert page.ask("set", "p_int64", value="9007199254740993") is None
    assert page.ask("get", "p_int64") == "9007199254740993"
    assert page.ask("call", "add", args={"left": 1, "right": 2.5}) == 3.5
    assert page.ask("call", "nothing") is None
    assert page.ask("get", "parts/7/name") == "number 7"
    assert page.ask("get", "named/right%20hand/name") == "named right hand"
    assert page.ask("set", "target", value=4.5) is None
    wait_until(lambda: page.ask("get", "seen_target") == 4.5)
    described = page.ask("describe", "head")
    assert described["type"] == "experimental.interop.Part"
    # Many at once: each answer finds its question.
    asked = {page.send("call", "add", args={"left": i, "right": 1}): i + 1 for i in range(50)}
    for number, total in asked.items():
        assert page.next(id=number)["result"] == total


def test_a_large_message_keeps_nobody_waiting(gateway, page):
    """Values of 8 MB, as JSON of 4 MB: they are read, made values of, made of values and freed beside the gateway's thread."""
    numbers = [1.5] * 1_000_000
    page.ask("set", "p_doubles", value=numbers)

    def share_of_longest(message):
        """How much of the time that it took somebody else waited for one answer."""
        page.socket.send(message)
        answers, longest, begin = [], 0, time.monotonic()
        answer = threading.Thread(target=lambda: answers.append(page.socket.recv(timeout=20)))
        answer.start()
        while answer.is_alive():
            asked = time.monotonic()
            assert http_api.ask(gateway, "GET", "/healthz").status == 200
            longest = max(longest, time.monotonic() - asked)
        assert '"result":' in answers[0][:100], answers[0][:100]
        return longest / (time.monotonic() - begin)

    asked = {"set": json.dumps({"id": 1, "op": "set", "path": "p_doubles", "value": numbers}),
             "get": json.dumps({"id": 1, "op": "get", "path": "p_doubles"})}
    # The machine may be busy with something else, but not each time.
    shares = {op: min(share_of_longest(message) for _ in range(8)) for op, message in asked.items()}
    page.ask("set", "p_doubles", value=[])
    assert max(shares.values()) < 0.15, shares


def test_a_socket_of_an_object_below(gateway):
    with Socket(gateway, BASE + "/parts/7?enums=number") as part:
        assert part.ask("get", "name") == "number 7"
        assert part.ask("call", "identify") == "part number 7"


def test_what_is_refused(page):
    assert page.refusal("get", "nope") == ("MemberNotFound", "object 'interop' (experimental.interop.Interop) has no member 'nope'")
    assert page.refusal("set", "version", value="2")[0] == "ReadOnlyMember"
    assert page.refusal("get", "secret")[0] == "WriteOnlyMember"
    assert page.refusal("set", "p_double", value="1")[1].startswith("read 'p_double': found a string, expected a number")
    assert page.refusal("set", "p_double")[1] == '"value" is missing'
    assert "misses the parameter 'right'" in page.refusal("call", "add", args={"left": 1})[1]
    assert page.refusal("call", "count_up", args={"first": 1, "count": 1})[1] == "'count_up' is a generator; use \"open\""
    assert page.refusal("fly")[0] == "InvalidArgument"
    assert page.refusal("get")[1] == "'interop' is a object; \"get\" is not for that"
    assert page.refusal("next", generator=99)[0] == "InvalidArgument"
    number = page.send("call", "fail", args={"kind": "custom", "text": "out of jam"})
    assert page.next(id=number)["error"] == {"name": "experimental.interop.InteropError", "message": "out of jam"}


def test_messages_that_are_none(page):
    for text in ["", "{", "[]", "7", '{"id":{},"op":"get"}', '{"op":7}', '{"id":1,"id":2,"op":"get"}', "[" * 5000]:
        page.socket.send(text)
        assert page.next(id=None)["error"]["name"].startswith("RobotRaconteur.")
    assert page.ask("get", "version") == "1"


@pytest.mark.parametrize("frame, code", [
    (b"\x82\x81\0\0\0\0x", 1003),  # binary
    (b"\x81\x82\0\0\0\0\xc3\x28", 1007),  # no UTF-8
    (b"\x81\x01x", 1002),  # without mask
    (b"\xc1\x81\0\0\0\0x", 1002),  # a reserved bit
    (b"\x80\x81\0\0\0\0x", 1002),  # goes on with nothing
    (b"\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff\0\0\0\0", 1009),
    (b"\x01\x81\0\0\0\0x" * 2, 1002),
])
def test_frames_that_are_wrong_close_the_socket(gateway, frame, code):
    with socket.create_connection(("127.0.0.1", gateway), timeout=20) as raw:
        raw.sendall(f"GET {BASE} HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode())
        stream = raw.makefile("rb")
        while (line := stream.readline().strip()):
            assert not line.lower().startswith(b"sec-websocket-protocol")  # none was named
        raw.sendall(frame)
        opcode, length = stream.read(2)
        assert opcode == 0x88
        assert struct.unpack(">H", stream.read(length)[:2]) == (code,)


def test_who_may_not_open_one(gateway):
    def status(path=BASE, protocol=JSON_PROTOCOL, **options):
        with pytest.raises(InvalidStatus) as refused:
            connect(f"ws://127.0.0.1:{gateway}{path}", subprotocols=[protocol], **options).__enter__()
        return refused.value.response.status_code

    assert status(origin="http://elsewhere.example") == 403
    assert status(protocol="soap") == 426
    assert status("/api/v1/devices/other/x") == 404
    assert status("/api/v1/devices/interop") == 404


def test_events(page):
    changed = page.open("subscribe", "changed")
    page.ask("call", "fire", args={"count": 3})
    seen = [page.next(subscription=changed) for _ in range(3)]
    assert sorted(each["value"]["value"] for each in seen) == [0, 1, 2]
    numbers = [each["number"] for each in seen]
    assert numbers == list(range(numbers[0], numbers[0] + 3))
    assert page.ask("unsubscribe", subscription=changed) is None
    assert page.refusal("unsubscribe", subscription=changed)[0] == "InvalidArgument"
    again = page.open("subscribe", "changed", after=numbers[0])
    assert [page.next(subscription=again)["number"] for _ in range(2)] == numbers[1:]


def test_events_have_one_number_for_all_who_ask(gateway):
    with Socket(gateway) as controller, Socket(gateway) as watcher:
        controller.open("callback", "ask")  # what is its own now
        both = [(each, each.open("subscribe", "changed")) for each in (watcher, controller)]
        watcher.ask("call", "fire", args={"count": 1})
        numbers = {each.next(subscription=changed)["number"] for each, changed in both}
        assert len(numbers) == 1


def test_wires(page):
    page.ask("call", "publish_state", args={"value": [1]})
    state = page.open("subscribe", "state")
    page.ask("call", "publish_state", args={"value": [2]})
    while (news := page.next(subscription=state))["value"] != [2]:
        pass
    assert int(news["time"]["seconds"]) > 0
    page.ask("send", "target", value=7.5)
    wait_until(lambda: page.ask("get", "seen_target") == 7.5)
    both = page.open("subscribe", "both")
    page.ask("send", "both", value=21)
    while page.next(subscription=both)["value"] != 42:
        pass


def test_an_id_that_is_used_again_names_what_was_opened_last(node, tmp_path):
    held = Held(b"pose")
    site = Site(tmp_path, node, start_device=start_service, make_line=held.line)
    try:
        with Socket(site.port) as page:
            page.ask("get", "version")
            held.is_on = True
            reused = page.send("subscribe", "pose")
            wait_until(lambda: held.messages)
            page.ask("unsubscribe", subscription=reused)
            page.socket.send(json.dumps({"id": reused, "op": "subscribe", "path": "changed"}))
            assert page.next(id=reused)["result"] is None
            held.is_on = False
            page.ask("call", "fire", args={"count": 1})
            assert page.next(id=reused)["error"]["message"] == "it was ended before it was open"
            page.ask("call", "publish_pose", args={"value": {"px": 1, "py": 2, "label": "x"}})
            page.ask("call", "fire", args={"count": 1})
            for _ in range(2):
                assert "number" in page.next(subscription=reused)
            page.ask("unsubscribe", subscription=reused)
    finally:
        site.stop()


def test_a_page_that_leaves_while_its_device_is_connected_again(node, tmp_path):
    site = Site(tmp_path, node, start_device=start_service)
    try:
        with Socket(site.port) as page:
            page.open("subscribe", "doubled")
            site.device.pause()
            before = len(site.line.streams)
            site.line.cut()
            page.next(state="connection_lost")
            page.send("get", "version")
            wait_until(lambda: any(site.line.streams[before:]))  # what the gateway says to the device
        wait_until(lambda: "client disconnected" in (tmp_path / "gateway.log").read_text())
        site.device.resume()
        with Socket(site.port) as page:
            assert page.ask("get", "version") == "1"
    finally:
        site.stop()


def test_more_packets_than_wait_at_a_time_arrive_in_order(page):
    doubled = page.open("subscribe", "doubled")
    count = 3000
    for value in range(count):
        page.socket.send(json.dumps({"op": "send", "path": "doubled", "value": value}))
    assert [page.next(subscription=doubled)["value"] for _ in range(count)] == [2 * value for value in range(count)]


def test_pipes(gateway):
    """A two-way pipe answers who has sent, and nobody else."""
    with Socket(gateway) as one, Socket(gateway) as other:
        first, second = one.open("subscribe", "doubled"), other.open("subscribe", "doubled")
        for value in range(100):
            one.send("send", "doubled", value=value)
        assert [one.next(subscription=first)["value"] for _ in range(100)] == [2 * value for value in range(100)]
        other.ask("send", "doubled", value=0.5)
        assert other.next(subscription=second)["value"] == 1
        one.ask("send", "doubled", value=-1)
        assert one.next(subscription=first)["state"] == "closed"
        one.ask("send", "doubled", value=4)  # opens it anew
        assert one.next(subscription=first)["value"] == 8
        poses = one.open("subscribe", "poses")
        one.ask("call", "publish_poses", args={"pose": {"px": 0, "py": 1, "label": "x"}, "count": 2})
        assert [one.next(subscription=poses)["value"]["px"] for _ in range(2)] == [0, 1]


def test_generators(page):
    counting = page.open("open", "count_up", args={"first": 5, "count": 2})
    assert [page.ask("next", generator=counting) for _ in range(3)] == [
        {"value": 5, "done": False}, {"value": 6, "done": False}, {"done": True}]
    assert page.refusal("next", generator=counting)[0] == "InvalidArgument"
    scaling = page.open("open", "scale", args={"factor": 2})
    assert [page.ask("next", generator=scaling, value=value)["value"] for value in (1, 2.5)] == [2, 5]
    assert page.refusal("next", generator=scaling)[1] == '"value" is missing'
    page.ask("close", generator=scaling)
    collecting = page.open("open", "collect")
    for part in ([1, 2], [3]):
        page.ask("next", generator=collecting, value=part)
    page.ask("close", generator=collecting)
    wait_until(lambda: page.ask("get", "collected") == [1, 2, 3])
    endless = page.open("open", "count_up", args={"first": 0, "count": 1_000_000})
    page.ask("abort", generator=endless)
    wait_until(lambda: page.ask("get", "generator_end") == "aborted")


def test_a_generator_that_has_failed_is_over(page):
    for _ in range(300):  # more than may be open at once
        failing = page.open("open", "count_up", args={"first": 0, "count": -1})
        page.ask("next", generator=failing)
        assert page.refusal("next", generator=failing)[0] == "OutOfRange"
    assert page.refusal("next", generator=failing)[0] == "InvalidArgument"


def test_a_client_who_leaves_ends_its_generators(gateway):
    with Socket(gateway) as page:
        page.open("open", "count_up", args={"first": 0, "count": 1_000_000})
        page.ask("next", generator=1)
    wait_until(lambda: ask(gateway, "GET", "/generator_end").json == "closed")
    assert ask(gateway, "GET", "/generator_end").json == "closed"


def test_callbacks(page):
    asked = page.open("callback", "ask")
    assert page.refusal("callback", "ask")[0] == "MemberBusy"
    page.ask("call", "start_ask", args={"question": "how far?"})
    question = page.next(callback=asked)
    assert question["args"] == {"question": "how far?"}
    assert page.ask("answer", call=question["call"], result=12.5) is None
    wait_until(lambda: page.ask("get", "answered") == 12.5)
    assert page.refusal("answer", call=question["call"], result=1)[0] == "InvalidArgument"

    page.ask("call", "start_ask", args={"question": "and now?"})
    page.ask("answer", call=page.next(callback=asked)["call"], error={"message": "no idea"})
    wait_until(lambda: page.ask("get", "answer_error") == "RobotRaconteur.OperationFailed")
    page.ask("call", "start_ask", args={"question": "may I?"})
    page.ask("answer", call=page.next(callback=asked)["call"], error={"name": "RobotRaconteur.OutOfRange", "message": "no"})
    wait_until(lambda: page.ask("get", "answer_error") == "RobotRaconteur.OutOfRange")
    page.ask("call", "start_ask", args={"question": "and here?"})
    page.ask("answer", call=page.next(callback=asked)["call"], result=7.5, error=None)
    wait_until(lambda: page.ask("get", "answered") == 7.5)
    page.ask("call", "start_ask", args={"question": "a number?"})
    assert "expected a number" in page.refusal("answer", call=page.next(callback=asked)["call"], result="12")[1]
    wait_until(lambda: page.ask("get", "answer_error") != "")
    notice = page.open("callback", "notice")
    page.ask("call", "start_notice", args={"number": 3})
    page.ask("answer", call=page.next(callback=notice)["call"])
    wait_until(lambda: page.ask("get", "answered") == 3)
    page.ask("unsubscribe", subscription=asked)
    page.ask("call", "start_ask", args={"question": "anybody?"})
    wait_until(lambda: page.ask("get", "answer_error") == "RobotRaconteur.InvalidOperation")


def test_a_question_that_is_not_answered(page):
    asked = page.open("callback", "ask")
    page.ask("call", "start_ask", args={"question": "hello?"})
    page.next(callback=asked)
    wait_until(lambda: page.ask("get", "answer_error") == "RobotRaconteur.OperationTimeout")


def test_memories(page):
    assert page.ask("shape", "m_grid") == [4, 3, 2]
    assert page.ask("read", "m_grid", offset=[0, 1, 0], count=[4, 1, 1]) == {"dims": [4, 1, 1], "data": [4, 5, 6, 7]}
    page.ask("write", "m_numbers", offset=[3], value=[30, 40])
    assert page.ask("read", "m_numbers", offset=[2], count=[4]) == [2, 30, 40, 5]
    page.ask("write", "m_numbers", offset=[3], value=[3, 4])
    assert len(page.ask("read", "m_large")) == 50_000
    assert page.refusal("read", "m_numbers", offset=[1, 2])[0] == "InvalidArgument"
    assert page.refusal("write", "m_fixed", value="AA==")[0] == "ReadOnlyMember"
    assert page.refusal("read", "m_numbers", count=[2**40])[0] == "BufferLimitViolation"
    assert page.refusal("write", "m_numbers", offset=[3], count=[1], value=[9, 9])[0] == "InvalidArgument"
    assert page.ask("read", "m_numbers", offset=[3], count=[2]) == [3, 4]


def test_users_and_locks(gateway):
    guarded = "/api/v1/devices/interop/guarded"
    with Socket(gateway, guarded) as page:
        assert page.refusal("get", "level")[0] in ("AuthenticationError", "PermissionDenied")
        assert page.refusal("login", username="alice", password="wrong")[0] == "AuthenticationError"
        page.ask("login", username="alice", password="secret")
        assert page.ask("call", "who") == "alice"
        credentials = base64.b64encode(b"bob:hunter2").decode()
        with Socket(gateway, guarded, additional_headers={"Authorization": "Basic " + credentials}) as other:
            assert other.ask("call", "who") == "bob"
            page.ask("lock", kind="client")
            assert other.refusal("set", "level", value=3)[0] == "ObjectLockedError"
            page.ask("set", "level", value=2)
            page.ask("unlock")
            other.ask("set", "level", value=1.5)


def test_a_failed_login_leaves_the_one_before(gateway):
    with Socket(gateway, "/api/v1/devices/interop/open") as page:
        assert page.refusal("login", username="mallory", password="wrong")[0] == "AuthenticationError"
        assert page.ask("call", "who") == ""


def test_bounds(page):
    for first in range(1, 257, 32):  # 64 may be unanswered at a time
        for _ in range(32):
            page.send("subscribe", "changed")
        for number in range(first, first + 32):
            assert "error" not in page.next(id=number)
    assert page.refusal("subscribe", "changed")[0] == "OutOfSystemResource"
    assert page.ask("unsubscribe", subscription=7) is None
    page.ask("subscribe", "changed")


class Lazy:
    """A client that reads only when it is told to: with a socket of its own, and little room in it."""

    def __init__(self, port):
        self.socket = socket.socket()
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        self.socket.settimeout(60)
        self.socket.connect(("127.0.0.1", port))
        self.socket.sendall(f"GET {BASE} HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode())
        self.stream = self.socket.makefile("rb")
        while self.stream.readline().strip():
            pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stream.close()
        self.socket.close()

    def send(self, **message):
        text = json.dumps({**message, "padding": "x" * 100}).encode()
        self.socket.sendall(b"\x81\xfe" + struct.pack(">H", len(text)) + b"\0\0\0\0" + text)

    def frame(self):
        first, length = self.stream.read(2)
        if length >= 126:
            length = struct.unpack(">H" if length == 126 else ">Q", self.stream.read(2 if length == 126 else 8))[0]
        return first, self.stream.read(length)


def test_a_reader_that_stops_is_told_and_closed(gateway):
    """It asks for 30 MB and does not read. The gateway keeps a bounded part, and goes on for everybody else."""
    with Lazy(gateway) as lazy, Socket(gateway) as busy:
        for number in range(40):
            lazy.send(id=number, op="call", path="ramp", args={"count": 100_000})
            assert busy.ask("call", "add", args={"left": number, "right": 1}) == number + 1
        texts = []
        while (frame := lazy.frame())[0] == 0x81:
            texts.append(frame[1])
        assert frame[0] == 0x88 and struct.unpack(">H", frame[1][:2]) == (1008,), frame
        assert len(texts) < 40
        assert json.loads(texts[-1])["error"]["message"] == "too slow: messages were lost, so the connection ends"
        assert busy.ask("get", "version") == "1"


def test_who_reads_a_wire_slowly_gets_the_newest(gateway):
    """30 MB of values while nobody reads: nobody is closed, and what comes in the end is the newest."""
    with Lazy(gateway) as lazy, Socket(gateway) as busy:
        lazy.send(id=1, op="subscribe", path="state")
        for number in range(60):
            busy.ask("call", "publish_state", args={"value": [number] * 100_000})
        busy.ask("call", "publish_state", args={"value": [-1]})
        seen = 0
        while True:
            first, text = lazy.frame()
            assert first == 0x81, text
            seen += 1
            if json.loads(text).get("value") == [-1]:
                break
        assert seen < 60


def test_two_thousand_values_of_a_wire(gateway):
    with Socket(gateway) as page:
        state = page.open("subscribe", "state")
        for _ in range(40):
            asked = [page.send("call", "publish_state", args={"value": [0] * 500}) for _ in range(50)]
            for number in asked:
                page.next(id=number)
        page.ask("call", "publish_state", args={"value": [1]})
        newest = page.next(subscription=state)["value"]
        while newest not in ([1], None):
            newest = page.next(subscription=state)["value"]
        assert newest == [1]


def test_subscriptions_and_callbacks_outlive_the_device(tmp_path):
    direction = next(each for each in DIRECTIONS if each.name == "reference-to-ours")
    service = Background(service_command(direction, "v4", "http://localhost"), tmp_path / "service.log")
    url = json.loads(service.next_line())["url"]
    process, port = start_gateway(tmp_path, url)
    try:
        with Socket(port) as page:
            asked, state = page.open("callback", "ask"), page.open("subscribe", "state")
            service.stop()
            assert page.next(subscription=state)["state"] == "connection_lost"
            assert page.refusal("get", "version")[0] == "ConnectionError"
            number = url.split(":")[2].split("/")[0]
            service = Background([*service_command(direction, "v4", "http://localhost"),
                                  f"--robotraconteur-tcp-port={number}"], tmp_path / "again.log")
            service.next_line()
            while page.next(subscription=state).get("state") != "connected":
                pass
            page.ask("call", "publish_state", args={"value": [2]})
            while page.next(subscription=state)["value"] != [2]:
                pass

            def is_asked():
                page.ask("call", "start_ask", args={"question": "still there?"})
                return page.ask("get", "answer_error") == ""

            wait_until(is_asked)
            page.ask("answer", call=page.next(callback=asked)["call"], result=1)
            # The gateway ends: so does the socket, with a reason.
            process.process.terminate()
            with pytest.raises(ConnectionClosed) as closed:
                while True:
                    page.socket.recv(timeout=20)
            assert closed.value.rcvd.code == 1001
        assert process.stop() == 0, process.description()
    finally:
        process.stop()
        service.stop()
