"""A recording that is kept: it replays with the same values, order and time stamps to all clients, and to the mcap package.

test/golden/recordings/create.mcap is five seconds of the simulated robot, which drives an arc, then straight on against a wall.
"""
import base64
import json
import queue
import subprocess

import pytest

from clients import JS
from gateways import RRGATE
from golden_recording import DEADLINE, FILE, MESSAGES, plain
from processes import Background


@pytest.fixture
def start_replay(tmp_path):
    running = []

    def start(*more):
        running.append(Background([RRGATE, "replay", FILE, "--paused", *more], tmp_path / "replay.log"))
        return running[-1].next_line().removeprefix("rrgate replay: ")

    yield start
    assert [process.stop() for process in running] == [0] * len(running)


def test_the_recording_is_what_it_was():
    assert FILE.stat().st_size < 100_000
    assert {kind for kind, *_ in MESSAGES} == {"wire", "property", "event"}
    told = json.loads(subprocess.run([RRGATE, "info", FILE, "--json"], capture_output=True, text=True, check=True).stdout)
    assert len(MESSAGES) == told["messages"] == 273
    states = [(stamp, value) for kind, member, stamp, value in MESSAGES if member == "state"]
    assert [stamp for stamp, _ in states] == sorted(stamp for stamp, _ in states)
    assert states[0][1]["x"] == 0 and states[-1][1]["x"] > 0.5
    assert [member for kind, member, *_ in MESSAGES if kind == "event"] == ["Bump"]


def test_the_real_package_gets_each_message_after_its_step(node, start_replay):
    url = start_replay()
    robot, replay = node.ConnectService(url), node.ConnectService(url.split("?")[0] + "?service=replay")
    come = {member: queue.Queue() for _, member, *_ in MESSAGES}

    def follow(member):
        wire = getattr(robot, member).Connect()
        wire.WireValueChanged += lambda _, value, at: come[member].put((at.seconds * 10**9 + at.nanoseconds, plain(value)))
        return wire

    wires = [follow(member) for member in {member for kind, member, *_ in MESSAGES if kind == "wire"}]
    robot.Bump += lambda: come["Bump"].put((None, {}))
    newest = {}  # time stamps
    try:
        for has_gone_back in False, True:
            for number, (kind, member, stamp, value) in enumerate(MESSAGES):
                replay.step(1)
                if kind == "property":
                    assert plain(getattr(robot, member)) == value, (number, member)
                    continue
                time, found = come[member].get(timeout=DEADLINE)
                assert found == value, (number, member)
                if kind == "wire":
                    assert time > newest[member] if has_gone_back else time == stamp, (number, member)
                    newest[member] = time
            assert all(each.empty() for each in come.values())
            replay.seek(0)
    finally:
        for wire in wires:
            wire.Close()
        for each in (robot, replay):
            node.DisconnectService(each)


def of_javascript(value):
    """Bytes are numbers there."""
    if isinstance(value, dict):
        return {name: list(base64.b64decode(each)) if name == "Data" else of_javascript(each) for name, each in value.items()}
    return value


def test_the_client_of_pages_gets_each_message_after_its_step(start_replay):
    url = start_replay().replace("rr+tcp", "ws")  # a node takes WebSockets on the same port
    steps = json.dumps({"messages": [(kind, member) for kind, member, *_ in MESSAGES]})
    done = subprocess.run(["node", JS / "replay.mjs", url], input=steps, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    heard = json.loads(done.stdout)["heard"]
    assert len(heard) == len(MESSAGES)
    for number, ((kind, member, stamp, value), (time, found)) in enumerate(zip(MESSAGES, heard)):
        if member == "song":
            value = list(base64.b64decode(value))
        wanted = [] if kind == "event" else of_javascript(value)
        assert (time, found) == (str(stamp) if kind == "wire" else None, wanted), (number, member)
