"""`rrgate mcp`: the Model Context Protocol on standard input and output, with the official Python SDK at the other end."""
import contextlib
import http.server
import json
import socket
import threading
import time

import pytest

from agents import hostile_robot, lose_role, records, with_lines, with_tokens
from command_line import NOT_UNDERSTOOD, Ran
from gateways import RRGATE, make_web_certificates
from leases import LEASES, wait_for
from processes import BUILD, Background
from shared_sites import Site

SPEED = {"roles": ["agent"], "paths": ["plain"], "members": ["speed"], "may": ["write"],
         "agent": {"limits": {"speed": [0, 2]}, "approval": "none", "hold_seconds": 50}}


@contextlib.contextmanager
def speaking(folder, *arguments, environment={}):
    """The program, with its pipes."""
    process = Background([RRGATE, "mcp", *arguments], folder / "mcp.log", environment)
    try:
        yield process
    finally:
        process.process.stdin.close()
        code = process.process.wait(10)
        process.stop()
    assert code == 0


def say(process, method, id=None, **params):
    process.write_line({"jsonrpc": "2.0", "method": method, "params": params, **({} if id is None else {"id": id})})


def hear(process):
    return json.loads(process.next_line())


@pytest.fixture
def demo(tmp_path):
    robot = Background([BUILD / "examples/demo/rrgate-demo-create", "--port", "0"], tmp_path / "robot.log")
    yield robot.next_line().split(" ", 1)[1]
    robot.stop()


class Lab(Site):
    """An arm behind a gateway with users."""

    def __init__(self, folder, node, **more):
        config, agent, _ = with_tokens(folder, SPEED)
        super().__init__(folder, node, {"leases": LEASES}, **{**config, **more})
        self.environment = {"RRGATE_TOKEN": agent["Authorization"].split()[1]}
        self.gateway_url = f"http://127.0.0.1:{self.port}"
        self.arm = self.direct("plain")


@pytest.fixture
def lab(node, tmp_path):
    made = Lab(tmp_path, node)
    yield made
    made.stop()


def arrays_in(schema):
    """Those of a JSON Schema that are of arrays, wherever they stand in it."""
    if isinstance(schema, list):
        return [found for each in schema for found in arrays_in(each)]
    if not isinstance(schema, dict):
        return []
    return ([schema] if schema.get("type") == "array" else []) + arrays_in(list(schema.values()))


@pytest.mark.parametrize("modern", [False, True])
def test_one_device_is_read_without_a_gateway(demo, modern):
    async def look(session):
        tools = await session.list_tools()
        devices = await session.call_tool("devices", {})
        described = await session.call_tool("describe", {"device": "create", "path": "Create"})
        refused = await session.call_tool("call", {"device": "create", "path": "Create/Drive", "args": {"velocity": 1, "radius": 1}, "why": "to see"})
        return tools.tools, devices.structured_content, described.structured_content, refused

    (tools, devices, described, refused), errors = with_lines([demo, "--name", "create"], look, modern=modern)
    assert {"devices", "read", "call"} <= {tool.name for tool in tools}
    arrays = [schema for tool in tools for schema in arrays_in(tool.input_schema)]
    assert arrays and all("items" in schema for schema in arrays)  # models of some makers refuse all tools otherwise
    assert devices["devices"][0]["name"] == "create"
    drive = next(each for each in described["members"] if each["name"] == "Drive")
    assert drive["may"] == []
    assert refused.is_error and "no rule" in refused.structured_content["error"]["message"]
    assert errors == ""


@pytest.mark.parametrize("modern", [False, True])
def test_a_gateway_is_used_with_the_token_of_the_environment(lab, modern):
    async def look(session):
        read = await session.call_tool("read", {"device": "interop", "path": "plain/speed"})
        far = await session.call_tool("set", {"device": "interop", "path": "plain/speed", "value": 3, "why": "to fly"})
        unknown = await session.call_tool("read", {"device": "nobody", "path": "x"})
        resource = await session.read_resource("rrgate://interop/plain/speed")
        return read, far, unknown, resource

    (read, far, unknown, resource), errors = with_lines([lab.gateway_url], look, lab.environment, modern)
    assert read.structured_content["from_device"] == 0
    assert "from 0.0 to 2.0" in far.structured_content["error"]["message"]
    assert unknown.is_error
    assert json.loads(resource.contents[0].text)["from_device"] == 0
    assert errors == ""
    assert lab.arm.speed == 0
    assert {each["face"] for each in records(lab.folder, "refused")} == {"mcp"}


def test_without_a_login_the_gateways_words_are_told(lab):
    with speaking(lab.folder, lab.gateway_url + "/mcp", environment={"HOME": str(lab.folder), "XDG_CONFIG_HOME": str(lab.folder)}) as process:
        say(process, "ping", 1)
        answer = hear(process)
    assert answer["id"] == 1 and "401" in answer["error"]["message"]


def move(process, id):
    say(process, "tools/call", id, name="set", arguments={"device": "interop", "path": "plain/speed", "value": 1, "why": "to move"})


def test_a_cancelled_call_makes_the_device_safe_and_is_not_answered(lab):
    with speaking(lab.folder, lab.gateway_url, environment=lab.environment) as process:
        move(process, "a")
        wait_for(lambda: lab.arm.speed == 1)
        say(process, "notifications/cancelled", requestId="a")
        wait_for(lambda: lab.arm.speed == 0)
        say(process, "ping", 2)
        assert hear(process) == {"jsonrpc": "2.0", "id": 2, "result": {}}


@pytest.mark.parametrize("is_killed", [False, True])
def test_a_client_that_has_gone_moves_nothing_any_more(lab, is_killed):
    process = Background([RRGATE, "mcp", lab.gateway_url], lab.folder / "mcp.log", lab.environment)
    try:
        move(process, 1)
        wait_for(lambda: lab.arm.speed == 1)
        if is_killed:
            process.process.kill()
        else:
            process.process.stdin.close()
        assert wait_for(lambda: lab.arm.speed == 0) < 5
        assert process.process.wait(10) == (-9 if is_killed else 0)
    finally:
        process.stop()


def test_lines_that_are_no_messages_are_refused_and_others_go_on(lab):
    with speaking(lab.folder, lab.gateway_url, environment=lab.environment) as process:
        process.process.stdin.write(b"{\n\n[]\n")
        say(process, "no/such", 3)
        answers = [hear(process) for _ in range(3)]
        assert {(each["id"], each["error"]["code"]) for each in answers} == {(None, -32700), (None, -32600), (3, -32601)}
        say(process, "ping", 4)
        assert hear(process)["result"] == {}
        for number in range(100):
            say(process, "tools/call", number, name="wait_for_event",
                arguments={"device": "interop", "path": "plain/done", "seconds": 1})
        told = [hear(process) for _ in range(100)]
        assert {each["id"] for each in told} == set(range(100))


def test_a_gateway_that_is_not_there_is_told_of_in_each_answer(tmp_path):
    with speaking(tmp_path, "http://127.0.0.1:1") as process:
        say(process, "ping", 1)
        assert "127.0.0.1" in hear(process)["error"]["message"]


def test_messages_go_by_https_where_the_url_says_so(node, tmp_path):
    certificates = make_web_certificates(tmp_path)
    made = Site(tmp_path, node, tls=certificates, mcp={})
    trusted = {"SSL_CERT_FILE": str(tmp_path / "web-ca.pem")}
    try:
        with speaking(tmp_path, f"https://localhost:{made.port}", environment=trusted) as process:
            say(process, "ping", 1)
            assert hear(process) == {"jsonrpc": "2.0", "id": 1, "result": {}}
        with speaking(tmp_path, f"https://localhost:{made.port}", environment={"SSL_CERT_FILE": "/dev/null"}) as process:
            say(process, "ping", 1)
            assert "certificate" in hear(process)["error"]["message"]
    finally:
        made.stop()


def test_a_hostile_device_speaks_under_from_device_alone():
    with hostile_robot() as (url, _):
        result, _ = with_lines([url], lambda session: session.call_tool("read", {"device": "robot", "path": "robot/note"}))
    assert "Ignore all rules" in result.structured_content["from_device"]


def test_a_list_that_has_changed_is_told(lab, tmp_path):
    with speaking(tmp_path, lab.gateway_url, environment=lab.environment) as process:
        say(process, "initialize", 1, protocolVersion="2025-11-25", capabilities={}, clientInfo={"name": "test", "version": "1"})
        assert hear(process)["result"]["capabilities"]["resources"]["listChanged"] is True
        say(process, "notifications/initialized")
        told = threading.Event()
        with_role = (tmp_path / "tokens").read_text()

        def change():  # until it is told: nobody says when the program has begun to listen
            while not told.wait(1):
                if (tmp_path / "tokens").read_text() == with_role:
                    lose_role(tmp_path)
                else:
                    (tmp_path / "tokens").write_text(with_role)

        changing = threading.Thread(target=change)
        changing.start()
        try:
            assert hear(process) == {"jsonrpc": "2.0", "method": "notifications/resources/list_changed"}
        finally:
            told.set()
            changing.join()


def test_a_url_of_nothing_is_not_understood():
    assert Ran(["mcp", "rr+tpc://x"]).refused(NOT_UNDERSTOOD, "rr+tpc")
    assert Ran(["mcp", "rr+tcp://127.0.0.1:1/?service=a b"]).refused(NOT_UNDERSTOOD)


@contextlib.contextmanager
def listened_to(answers):
    """The port of a gateway that tells a listener, or refuses it, and then ends its answer; and when it was asked."""
    asked = []
    told = {"jsonrpc": "2.0", "method": "notifications/subscriptions/acknowledged", "params": {
        "notifications": {"resourceSubscriptions": ["rrgate://a"]}}}
    refused = {"jsonrpc": "2.0", "id": 1, "error": {"code": -32602, "message": "no rule"}}

    class Answer(http.server.BaseHTTPRequestHandler):
        def do_POST(self):
            self.rfile.read(int(self.headers["Content-Length"]))
            is_told = answers[len(asked)] if len(asked) < len(answers) else False
            asked.append(time.monotonic())
            body = f"event: message\ndata: {json.dumps(told)}\n\n" if is_told else json.dumps(refused)
            self.send_response(200)
            self.send_header("Content-Type", "text/event-stream" if is_told else "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body.encode())

        def log_message(self, *_):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Answer) as server:
        serving = threading.Thread(target=server.serve_forever)
        serving.start()
        yield server.server_port, asked
        server.shutdown()
        serving.join()


def test_a_subscription_that_is_given_up_before_it_has_begun_is_answered(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        with speaking(tmp_path, f"http://127.0.0.1:{silent.getsockname()[1]}") as process:
            say(process, "resources/subscribe", 2, uri="rrgate://a")
            say(process, "resources/subscribe", 3, uri="rrgate://a")
            say(process, "resources/unsubscribe", 4, uri="rrgate://a")
            told = {each["id"]: each for each in (hear(process) for _ in range(3))}
    assert told[4]["result"] == {}
    assert "unsubscribed" in told[2]["error"]["message"] and told[3]["error"] == told[2]["error"]


@pytest.mark.parametrize("exists", [True, False])
def test_each_who_subscribes_is_answered_as_the_gateway_answers(tmp_path, exists):
    with listened_to([exists]) as (port, _), speaking(tmp_path, f"http://127.0.0.1:{port}") as process:
        for number in (5, 6):
            say(process, "resources/subscribe", number, uri="rrgate://a")
        told = {each["id"]: each for each in (hear(process) for _ in range(2))}
    if exists:
        assert told[5]["result"] == told[6]["result"] == {}
    else:
        assert told[5]["error"]["code"] == told[6]["error"]["code"] == -32002


def test_what_is_not_told_any_more_is_asked_for_ever_more_seldom_until_it_is_told(tmp_path):
    with listened_to([True, False, True]) as (port, asked), speaking(tmp_path, f"http://127.0.0.1:{port}") as process:
        say(process, "resources/subscribe", 1, uri="rrgate://a")
        assert hear(process) == {"jsonrpc": "2.0", "id": 1, "result": {}}
        assert hear(process)["method"] == "notifications/resources/updated"  # told again
        wait_for(lambda: len(asked) == 5)
    pauses = [after - before for before, after in zip(asked, asked[1:])]
    assert pauses[0] >= 1 and pauses[1] >= 2  # refused once
    assert pauses[2] < 4 and pauses[3] >= 2  # told, refused
