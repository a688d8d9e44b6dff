"""What agents see and hear by the Model Context Protocol: images, wires over a time, packets, generators; how far a request is, and
its end. The agent is the official Python SDK."""
import base64
import contextlib
import functools
import http.client
import io
import json
import os
import sys
import threading

import anyio
import pytest
from PIL import Image

import issuers
from agents import call, meanwhile, records, with_agent, with_tokens
from directions import PEERS
from gateways import make_web_certificates, running
from http_api import BASE, ask
from leases import LEASES, wait_for
from processes import Background, start_gateway
from shared_sites import Site, start_service

CALLS = {"roles": ["agent"], "may": ["call"], "agent": {"approval": "none", "lease": False}}
CAMERA = "/api/v1/devices/interop/camera"


@pytest.fixture(scope="module")
def camera(tmp_path_factory):
    folder = tmp_path_factory.mktemp("camera")
    device = Background([sys.executable, PEERS / "images.py"], folder / "device.log")
    config, agent, admin = with_tokens(folder, CALLS)
    gateway, port = start_gateway(folder, json.loads(device.next_line())["url"], device={"mode": "shared"}, **config)
    yield port, agent, functools.partial(ask, port, headers=admin, base=CAMERA)
    gateway.stop()
    device.stop()


class Lab(Site):
    """The test service, an agent that may call everything, and a person."""

    def __init__(self, folder, node):
        config, self.agent, self.admin = with_tokens(folder, CALLS)
        super().__init__(folder, node, start_device=start_service, **config)

    def rest(self, method, path, body=None):
        answer = ask(self.port, method, path, body, self.admin, BASE)
        assert answer.status < 300, answer.body
        return answer.json if answer.body else None

    def call(self, tool, path, **arguments):
        return call(self.port, tool, self.agent, device="interop", path=("interop/" + path).rstrip("/"), **arguments)


@pytest.fixture(scope="module")
def lab(node, tmp_path_factory):
    made = Lab(tmp_path_factory.mktemp("lab"), node)
    yield made
    made.stop()


def frame(width, height, encoding, data):
    return {"width": width, "height": height, "format": encoding, "data": base64.b64encode(data).decode()}


def image_of(result):
    """The image beside a text, which says what it is."""
    assert not result.is_error, result.content
    text, image = result.content
    assert image.type == "image"
    data = base64.b64decode(image.data)
    assert result.structured_content["image"]["bytes"] == len(data) <= 256 * 1024
    assert "from_device" not in result.structured_content
    return image.mime_type, data, result.structured_content["image"]


def test_a_property_that_is_an_image_comes_as_one(camera):
    port, agent, rest = camera
    assert rest("PUT", "/still", frame(64, 32, "rgb8", bytes((200, 100, 50)) * 64 * 32)).status == 204
    kind, data, about = image_of(call(port, "read", agent, device="interop", path="camera/still"))
    shown = Image.open(io.BytesIO(data))
    assert (kind, shown.size, about["width"], about["height"]) == ("image/jpeg", (64, 32), 64, 32)
    assert all(abs(found - meant) < 6 for found, meant in zip(shown.getpixel((20, 10)), (200, 100, 50)))

    async def look(session):
        return await session.read_resource("rrgate://interop/camera/still")

    resource = with_agent(port, look, agent).contents[0]
    assert resource.mime_type == "image/jpeg" and base64.b64decode(resource.blob) == data


def test_large_images_become_smaller_ones(camera):
    port, agent, rest = camera
    assert rest("PUT", "/still", frame(2500, 1200, "mono8", bytes([80]) * 2500 * 600 + bytes([160]) * 2500 * 600)).status == 204
    _, data, about = image_of(call(port, "read", agent, device="interop", path="camera/still"))
    shown = Image.open(io.BytesIO(data))
    assert shown.size == (about["width"], about["height"]) and max(shown.size) <= 1024
    assert abs(shown.getpixel((400, 10)) - 80) < 6 and abs(shown.getpixel((400, shown.size[1] - 10)) - 160) < 6
    assert rest("PUT", "/still", frame(1024, 1024, "rgb8", os.urandom(1024 * 1024 * 3))).status == 204
    image_of(call(port, "read", agent, device="interop", path="camera/still"))


def test_what_the_device_has_compressed_comes_as_it_is_where_it_is_small_enough(camera):
    port, agent, rest = camera
    for kind, size, fits in (("PNG", 60, True), ("JPEG", 60, True), ("PNG", 800, False), ("JPEG", 800, False)):
        packed = io.BytesIO()
        Image.frombytes("RGB", (size, size), os.urandom(size * size * 3)).save(packed, kind, **({"quality": 95} if kind == "JPEG" else {}))
        assert rest("PUT", "/still", frame(size, size, "", packed.getvalue())).status == 204
        result = call(port, "read", agent, device="interop", path="camera/still")
        if fits:
            assert image_of(result)[:2] == ("image/" + kind.lower(), packed.getvalue())
        else:
            assert result.is_error and "compressed by the device" in json.dumps(result.structured_content)


def test_images_of_wires_pipes_and_functions(camera):
    port, agent, rest = camera
    done = threading.Event()

    def show():
        while not done.wait(0.05):
            rest("POST", "/show", {"frame": frame(16, 8, "mono8", bytes(128))})

    showing = threading.Thread(target=show)
    showing.start()
    try:
        wire = call(port, "read", agent, device="interop", path="camera/live")
        packet = call(port, "wait_for_event", agent, device="interop", path="camera/frames", seconds=20)
        many = call(port, "wait_for_event", agent, device="interop", path="camera/frames", seconds=5, count=2)
        watched = call(port, "watch", agent, device="interop", path="camera/live", seconds=0.5)
    finally:
        done.set()
        showing.join()
    captured = call(port, "call", agent, device="interop", path="camera/capture", args={"width": 16, "height": 8}, why="to see")
    for result in (wire, packet, watched, captured):
        assert Image.open(io.BytesIO(image_of(result)[1])).size == (16, 8)
    assert isinstance(wire.structured_content["age_ms"], int)
    assert packet.structured_content["happened"] and watched.structured_content["count"] > 1
    assert many.is_error and "one at a time" in json.dumps(many.structured_content)


def test_an_image_that_lies_about_its_size_is_told_of(camera):
    port, agent, rest = camera
    assert rest("PUT", "/still", frame(5000, 5000, "rgb8", b"short")).status == 204
    result = call(port, "read", agent, device="interop", path="camera/still")
    assert result.is_error and len(result.content) == 1


@contextlib.contextmanager
def publishing(lab, path, bodies):
    """Calls a function again and again."""
    done = threading.Event()

    def publish():
        while True:
            for body in bodies:
                lab.rest("POST", path, body)
                if done.wait(0.01):
                    return

    thread = threading.Thread(target=publish)
    thread.start()
    yield
    done.set()
    thread.join()


def pose(px, py=0):
    return {"px": px, "py": py, "label": "here"}


def test_a_wire_is_watched_and_summarised(lab):
    with publishing(lab, "/publish_pose", [{"value": pose(1, -4)}, {"value": pose(2, -4)}, {"value": pose(3, -4)}]):
        told = lab.call("watch", "pose", seconds=1).structured_content
    assert told["count"] > 5 and told["per_second"] > 2 and told["was_lost"] is False
    said = told["from_device"]
    assert set(said["first"]) == {"px", "py", "label"} and said["last"]["label"] == "here"
    assert said["numbers"].keys() == {"px", "py"}
    assert said["numbers"]["py"] == {"min": -4, "max": -4, "mean": -4}
    assert (said["numbers"]["px"]["min"], said["numbers"]["px"]["max"]) == (1, 3) and 1 < said["numbers"]["px"]["mean"] < 3
    assert lab.call("watch", "target").is_error
    described = lab.call("describe", "pose").structured_content["members"][0]
    assert described["may"] == ["read", "subscribe"]


def test_the_next_packets_of_a_pipe(lab):
    with publishing(lab, "/publish_poses", [{"pose": pose(0), "count": 3}]):
        told = lab.call("wait_for_event", "poses", count=7, seconds=20).structured_content
    assert told["happened"] is True and [each["px"] for each in told["from_device"][:1]] in ([0], [1], [2])
    assert len(told["from_device"]) == 7
    few = lab.call("wait_for_event", "poses", count=7, seconds=0.2).structured_content
    assert few["happened"] is False and few["from_device"] == []
    for count in (0, 101, 1.5, "2"):
        assert lab.call("wait_for_event", "poses", count=count).is_error


def test_what_the_gateway_refuses_is_said_in_its_own_words(lab):
    for tool, path, words in (("read", "changed", "is not for that"), ("watch", "p_double", "is not for that"),
                              ("wait_for_event", "p_double", "is not for that"), ("watch", "target", "can only be written"),
                              ("read", "no_such", "no member"), ("read", "head/no_such", "no member"),
                              ("read", "parts", "needs an index"), ("describe", "p_double/x", "nothing is below it")):
        error = lab.call(tool, path).structured_content["error"]
        assert words in error["message"] and "from_device" not in error, (tool, path)
    gone = lab.call("read", "parts/99/size").structured_content["error"]
    assert "no part" in gone["from_device"] and "message" not in gone


def test_a_generator_runs_to_its_end_or_to_as_many_results_as_are_wanted(lab):
    whole = lab.call("call", "count_up", args={"first": 1, "count": 4}, why="to count").structured_content
    assert (whole["from_device"], whole["has_ended"]) == ([1, 2, 3, 4], True)
    part = lab.call("call", "count_up", args={"first": 1, "count": 1000}, why="to count", most=3).structured_content
    assert (part["from_device"], part["has_ended"]) == ([1, 2, 3], False)
    wait_for(lambda: lab.rest("GET", "/generator_end") == "closed")
    failed = lab.call("call", "count_up", args={"first": 1, "count": -2}, why="to count")
    assert failed.is_error and "no more" in failed.structured_content["error"]["from_device"]
    taking = lab.call("call", "scale", args={"factor": 1}, why="to scale")
    assert "is sent a value for each step" in taking.structured_content["error"]["message"]
    dry = lab.call("call", "count_up", args={"first": 1, "count": 4}, why="to count", dry_run=True).structured_content
    assert dry["would_send"] == {"first": 1, "count": 4}
    found = {each["name"]: each["may"] for each in lab.call("describe", "").structured_content["members"]}
    assert found.get("count_up", ["call"]) == ["call"] and found.get("scale", []) == []
    assert [each["outcome"] for each in records(lab.folder, "call") if each["user"] == "agent"][:3] == ["ok", "ok", "error"]


MOVES = {"roles": ["agent"], "paths": ["plain"], "members": ["speed", "move"], "may": ["write", "call"],
         "agent": {"approval": "none", "hold_seconds": 50}}


@pytest.fixture
def arm(node, tmp_path):
    config, agent, admin = with_tokens(tmp_path, MOVES)
    made = Site(tmp_path, node, {"leases": LEASES}, **config)
    made.agent, made.admin, made.arm = agent, admin, made.direct("plain")
    yield made
    made.stop()


@pytest.mark.parametrize("modern", [False, True])
def test_who_wants_to_know_hears_how_far_a_request_is(arm, modern):
    heard = []

    async def note(progress, total, message):
        heard.append((progress, message))
        if len(heard) == 2:
            arm.arm.finish()

    async def move(session):
        return await session.call_tool("call", {"device": "interop", "path": "plain/move", "args": {"position": 2}, "why": "to move"},
                                       progress_callback=note, read_timeout_seconds=5)

    with contextlib.suppress(Exception):  # the lease is held for longer than anybody waits here
        with_agent(arm.port, move, arm.agent, modern)
    assert len(heard) >= 3
    assert [progress for progress, _ in heard] == sorted(progress for progress, _ in heard)
    assert {message for _, message in heard} == {"the device is at work", "the lease is held"}
    wait_for(lambda: arm.arm.seen_target == -1)


@pytest.mark.parametrize("modern", [False, True])
def test_a_request_that_its_client_cancels_ends_and_the_device_is_made_safe(arm, modern):
    async def move(session):
        async def set_speed():
            await session.call_tool("set", {"device": "interop", "path": "plain/speed", "value": 1, "why": "to move"})

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(set_speed)
            while arm.arm.speed != 1:
                await anyio.sleep(0.01)
            tasks.cancel_scope.cancel()
        with anyio.CancelScope(shield=True):
            while arm.arm.speed != 0:
                await anyio.sleep(0.01)
            return await session.call_tool("read", {"device": "interop", "path": "plain/speed"})

    assert with_agent(arm.port, move, arm.agent, modern).structured_content["from_device"] == 0


def message(port, headers, method, id=None, **params):
    body = {"jsonrpc": "2.0", "method": method, "params": params, **({} if id is None else {"id": id})}
    return ask(port, "POST", "/mcp", body, headers)


def test_only_who_knows_the_session_cancels_its_requests(arm):
    session = {"Mcp-Session-Id": message(arm.port, arm.agent, "initialize", 1).headers["Mcp-Session-Id"]}
    other = {"Mcp-Session-Id": message(arm.port, arm.agent, "initialize", 1).headers["Mcp-Session-Id"]}
    assert session != other
    arguments = {"name": "set", "arguments": {"device": "interop", "path": "plain/speed", "value": 1, "why": "to move"}}
    with meanwhile(lambda: message(arm.port, {**arm.agent, **session}, "tools/call", 7, **arguments)) as results:
        wait_for(lambda: arm.arm.speed == 1)
        for headers in ({**arm.agent, **other}, arm.agent, {**arm.admin, **session}):
            assert message(arm.port, headers, "notifications/cancelled", requestId=7).status == 202
        assert message(arm.port, {**arm.agent, **session}, "notifications/cancelled", requestId="7").status == 202
        assert arm.arm.speed == 1
        assert message(arm.port, {**arm.agent, **session}, "notifications/cancelled", requestId=7).status == 202
        wait_for(lambda: arm.arm.speed == 0)
    assert b"data:" not in results[0].body
    with meanwhile(lambda: message(arm.port, {**arm.agent, **session}, "tools/call", 8, **arguments)) as results:
        wait_for(lambda: arm.arm.speed == 1)
        assert ask(arm.port, "DELETE", "/mcp", headers={**arm.agent, **session}).status == 204
        wait_for(lambda: arm.arm.speed == 0)


def test_a_refusal_by_rate_is_in_the_audit_log(node, tmp_path):
    config, agent, _ = with_tokens(tmp_path)
    made = Site(tmp_path, node, rates={"device": {"per_second": 1}}, **config)
    try:
        results = [call(made.port, "read", agent, device="interop", path="plain/speed") for _ in range(4)]
    finally:
        made.stop()
    assert any("too many requests to device" in json.dumps(each.structured_content) for each in results if each.is_error)
    refused = [each for each in records(tmp_path, "refused") if each["detail"] == "too many requests to the device"]
    assert refused and {(each["face"], each["user"], each["device"], each["outcome"]) for each in refused} == {
        ("mcp", "agent", "interop", "refused")}


def test_no_rate_holds_up_whoever_stops_all_agents(node, tmp_path):
    config, agent, admin = with_tokens(tmp_path)
    made = Site(tmp_path, node, rates={"client": {"per_second": 1}}, **config)
    try:
        assert 429 in [ask(made.port, "GET", "/api/v1/devices", headers=admin).status for _ in range(5)]
        assert ask(made.port, "POST", "/api/v1/agents/stop", {"minutes": 0}, agent).status == 429
        assert ask(made.port, "POST", "/api/v1/agents/stop", {"minutes": 0}, admin).status == 200
    finally:
        made.stop()


def test_no_rate_holds_up_an_agent_that_stops_something(node, tmp_path):
    config, agent, _ = with_tokens(tmp_path)
    for of in ("client", "user"):
        made = Site(tmp_path, node, {"leases": LEASES}, rates={of: {"per_second": 1}}, **config)
        try:
            session = {"Mcp-Session-Id": message(made.port, agent, "initialize", 1).headers["Mcp-Session-Id"], **agent}
            devices = {"name": "devices", "arguments": {}}
            assert 429 in [message(made.port, session, "tools/call", 2, **devices).status for _ in range(5)]
            stop = {"name": "stop", "arguments": {"device": "interop", "path": "plain"}}
            stopped = message(made.port, session, "tools/call", 3, **stop)
            assert stopped.status == 200 and not stopped.json["result"]["isError"]
            assert message(made.port, session, "notifications/cancelled", requestId=2).status == 202
            assert message(made.port, session, "tools/call", 4, **devices).status == 429
            # Whoever may do nothing, or asks for more than a stop takes, is stopped by the rate as everybody.
            large = {**stop, "arguments": {**stop["arguments"], "why": "x" * 5000}}
            assert message(made.port, session, "tools/call", 5, **large).status == 413
            assert of == "user" or message(made.port, {}, "tools/call", 6, **stop).status == 429
            assert ask(made.port, "DELETE", "/mcp", headers=session).status == 204
            assert ask(made.port, "GET", "/api/v1/devices", headers=agent).status == 429
        finally:
            made.stop()


def test_agents_are_told_whose_tokens_are_believed(node, tmp_path):
    make_web_certificates(tmp_path / "id")
    server = issuers.IssuerServer(tmp_path / "id" / "localhost.pem", tmp_path / "id" / "localhost.key")
    jwt = {"discover": True, "issuer": server.url, "audience": "rrgate", "ca": [str(tmp_path / "id" / "web-ca.pem")]}
    try:
        with running(tmp_path, {"devices": [], "access": {"jwt": jwt}, "mcp": {}}) as gateway:
            refused = message(gateway.port, {}, "ping", 1)
            url = f"http://127.0.0.1:{gateway.port}/.well-known/oauth-protected-resource/mcp"
            assert refused.status == 401 and f'resource_metadata="{url}"' in refused.headers["WWW-Authenticate"]
            assert "resource_metadata" not in ask(gateway.port, "GET", "/api/v1/devices").headers["WWW-Authenticate"]
            told = ask(gateway.port, "GET", "/.well-known/oauth-protected-resource/mcp").json
            assert told["resource"] == f"http://127.0.0.1:{gateway.port}/mcp"
            assert told["authorization_servers"] == [server.url]
        with running(tmp_path, {"devices": [], "mcp": {}}) as gateway:
            assert ask(gateway.port, "GET", "/.well-known/oauth-protected-resource/mcp").status == 404
    finally:
        server.stop()
