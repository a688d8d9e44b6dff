"""The clients of examples/create-minimal: with the simulated robot, with the paper's service and with the example's own, on a
robot of bytes."""
import contextlib
import json
import re
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest

from clients import run_program
from command_line import run
from paper_service import QUIET, running_service
from processes import BUILD, ROOT, Background, start_gateway
from serial_scenarios import Robot, wait_for

EXAMPLE = ROOT / "examples" / "create-minimal"
DEMO = BUILD / "examples/demo"
CLIENTS = ("cpp", "py", "mjs")
WITHIN = 60  # seconds for one client
DRIVE, STOP, STREAM, PAUSE = [137, 0, 100, 127, 255], [137, 0, 0, 127, 255], [148, 4, 7, 19, 20, 18], [150, 0]


def words(command):
    return " ".join(map(str, command))


def told_by(client):
    """What reaches the robot. At the end of a lease the gateway makes it safe, whatever the holder has done."""
    return [STREAM, DRIVE, STOP, PAUSE, *([STOP] if client == "mjs" else [])]


@contextlib.contextmanager
def started(client, url, folder):
    """The client as a process, with a gateway where it needs one: that of the example."""
    with contextlib.ExitStack() as ending:
        if client == "mjs":
            [device] = json.loads((EXAMPLE / "gateway.json").read_text())["devices"]
            gateway, port = start_gateway(folder, url, device={**device, "url": url})
            ending.callback(gateway.stop)
            shutil.copy(EXAMPLE / "client.mjs", folder)
            (folder / "node_modules").mkdir()
            (folder / "node_modules/rrgate-client").symlink_to(ROOT / "wasm-client")
            command = ["node", folder / "client.mjs", f"ws://127.0.0.1:{port}/devices/create?service=Create"]
        else:
            command = {"cpp": [BUILD / "test/interop/cpp/rr-example-create-client"], "py": [sys.executable, EXAMPLE / "client.py"]}[client]
            command = [*command, url]
        errors = ending.enter_context((folder / "client.log").open("w"))
        process = ending.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True))
        ending.callback(process.kill)
        yield process


def lines_of(process, folder):
    """What it prints until it ends as it should."""
    said = process.stdout.read()
    assert process.wait(WITHIN) == 0, said + (folder / "client.log").read_text()
    return said.splitlines()


def split(lines):
    """(distance before, packets, bumps, distance after)"""
    first, *middle, last = lines
    distances = [int(re.fullmatch(r"DistanceTraveled: (-?\d+) mm", line)[1]) for line in (first, last)]
    packets = [line for line in middle if line != "bump"]
    assert 1 <= len(packets) <= 5, lines
    return distances[0], packets, len(middle) - len(packets), distances[1]


@pytest.mark.parametrize("client", CLIENTS)
def test_the_simulated_robot_is_driven_and_stands_at_the_end(client, tmp_path):
    robot = Background([DEMO / "rrgate-demo-create", "--port", "0"], tmp_path / "robot.log")
    try:
        url = robot.next_line().removeprefix("create: ")
        with started(client, url, tmp_path) as process:
            before, packets, _, after = split(lines_of(process, tmp_path))
        assert before == 0 and after >= 50
        assert all(re.fullmatch(r"packet 6:( \d+){52}", packet) for packet in packets)
        robot.wait_until(lambda: json.loads(run("get", url, "state", "--json"))["velocity"] == 0)
    finally:
        assert robot.stop() == 0


@pytest.mark.parametrize("client", CLIENTS)
def test_the_robot_is_told_what_the_paper_tells_it(client, tmp_path):
    """The paper's service does not stop the robot by itself, and its robot runs against something after 100 mm."""
    with running_service(tmp_path) as (port, sent):
        with started(client, f"rr+tcp://127.0.0.1:{port}/?service=Create", tmp_path) as process:
            before, packets, bumps, after = split(lines_of(process, tmp_path))
        told = sent(lambda lines: len(lines) >= 3 + len(told_by(client)))
    assert (before, bumps, after) == (0, 1, 100)
    assert packets[-1] == "packet 19: 7 0 19 0 0 20 0 0 18 0"
    assert told[3:] == [words(command) for command in told_by(client)]


@pytest.mark.parametrize("client", CLIENTS)
def test_ctrl_c_ends_the_drive(client, tmp_path):
    with running_service(tmp_path) as (port, sent):
        with started(client, f"rr+tcp://127.0.0.1:{port}/?service=Create", tmp_path) as process:
            while not process.stdout.readline().startswith("packet"):
                assert process.poll() is None
            process.send_signal(signal.SIGINT)
            assert lines_of(process, tmp_path)[-1].startswith("DistanceTraveled: ")
        told = sent(lambda lines: lines.count(words(PAUSE)) == 2)
    assert told[4:7] == [words(command) for command in (DRIVE, STOP, PAUSE)]


def test_the_gateway_stops_the_robot_of_a_client_that_dies(tmp_path):
    with running_service(tmp_path) as (port, sent):
        with started("mjs", f"rr+tcp://127.0.0.1:{port}/?service=Create", tmp_path) as process:
            while not process.stdout.readline().startswith("packet"):
                assert process.poll() is None
            process.kill()
            told = sent(lambda lines: words(STOP) in lines)
    assert told[4:6] == [words(DRIVE), words(STOP)]


SERVICES = {"cpp": [DEMO / "rrgate-create-serial"], "py": [sys.executable, EXAMPLE / "create_serial.py"]}


def start_service(language, robot, folder):
    return Background([*SERVICES[language], robot.device, "0", *(QUIET if language == "py" else [])], folder / "service.log")


@pytest.mark.parametrize("client, language", [(client, language) for client in CLIENTS for language in SERVICES
                                              if (client, language) != ("py", "cpp")])  # the reference refuses the definition
def test_the_examples_own_service(client, language, tmp_path):
    robot = Robot()
    service = start_service(language, robot, tmp_path)
    try:
        with started(client, service.next_line(), tmp_path) as process:
            while process.poll() is None:
                robot.say(robot.packet(distance=5))
                time.sleep(0.02)
            before, packets, _, after = split(lines_of(process, tmp_path))
        assert after > before
        assert set(packets) == {"packet 19: 7 0 19 0 5 20 0 0 18 0"}
        wait_for(lambda: robot.commands[3:] == told_by(client))
    finally:
        service.stop()
        robot.unplug()


@pytest.mark.parametrize("language", SERVICES)
def test_who_drives_is_asked_for_a_song(language, tmp_path):
    robot = Robot()
    service = start_service(language, robot, tmp_path)
    pressed = threading.Event()

    def press():
        while not pressed.wait(0.02):
            robot.say(robot.packet(buttons=int([137, 0, 100, 3, 232] in robot.commands)))

    presser = threading.Thread(target=press, daemon=True)
    presser.start()
    try:
        done = run_program([BUILD / "test/interop/cpp/rr-test-client", service.next_line()], [
            {"answer": "play_callback", "value": {"uint8[]": [69, 16, 60, 16, 69]}},
            {"call": "Drive", "args": [{"int16": 100}, {"int16": 1000}]},
            {"asked": "play_callback", "count": 1}])
        assert done["results"][-1]["value"] == {"list": [[0, 0]]}
        wait_for(lambda: [141, 0] in robot.commands)
        assert [command for command in robot.commands if command[0] in (140, 141)] == [[140, 0, 2, 69, 16, 60, 16], [141, 0]]
    finally:
        pressed.set()
        presser.join()
        service.stop()
        robot.unplug()


def test_the_reference_refuses_the_definition_of_the_paper(tmp_path):
    robot = Robot()
    service = Background([DEMO / "rrgate-create-serial", robot.device, "0"], tmp_path / "service.log")
    try:
        with started("py", service.next_line(), tmp_path) as process:
            assert process.wait(WITHIN) != 0
        assert "ServiceDefinitionError" in (tmp_path / "client.log").read_text()
        assert DRIVE not in robot.commands
    finally:
        service.stop()
        robot.unplug()
