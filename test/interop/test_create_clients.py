"""The clients of examples/create-minimal: with the simulated robot, with the paper's service and with the example's own, on a
robot of bytes."""
import base64
import contextlib
import json
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import urllib.request

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


def gateway_of_the_example(folder, url):
    [device] = json.loads((EXAMPLE / "gateway.json").read_text())["devices"]
    return start_gateway(folder, url, device={**device, "url": url})


@contextlib.contextmanager
def started(client, url, folder):
    """The client as a process, with a gateway where it needs one: that of the example."""
    with contextlib.ExitStack() as ending:
        if client == "mjs":
            gateway, port = gateway_of_the_example(folder, url)
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


class MatlabScript:
    """The requests of client_http.m, as Octave makes them: read in its text, in the order in which they are made.

    Octave itself is no part of the tests: it takes some 250 MB.
    """

    def __init__(self, gateway):
        text = (EXAMPLE / "client_http.m").read_text()
        pieces = re.search(r"system\(sprintf\(\[(.*?)\], key, body, url\)\)", text, re.DOTALL)[1]
        self._curl = "".join(piece.replace("''", "'") for piece in re.findall(r"'((?:[^'\n]|'')*)'", pieces))
        self._functions = {each.split("(")[0].split()[-1]: each for each in re.split(r"^function ", text, flags=re.MULTILINE)[1:]}
        self._create = gateway + re.search(r"create = \[gateway '(.*)'\];", text)[1]
        self._key = ""
        self.said = []

    def run(self):
        lines = self._functions["client_http"].splitlines()
        begin = next(i for i, line in enumerate(lines) if line.startswith("for step = 1:5"))
        end = lines.index("end", begin)
        for line in [*lines[:begin], *lines[begin + 1:end] * 5, *lines[end + 1:], *self._functions["finish"].splitlines()]:
            self._carry_out(line)

    def _carry_out(self, line):
        if found := re.search(r"(?<!@)\bcall\(create, '(\w+)', struct\((.*?)\), (key|'')\);", line):
            fields = [field.strip().strip("'") for field in found[2].split(",")] if found[2] else []
            self._post(f"/{found[1]}", dict(zip(fields[::2], map(int, fields[1::2]))), found[3])
        elif found := re.search(r"post\(\[create '(.*?)'\], struct\(\), (key|'')\);", line):
            answer = self._post(found[1], {}, found[2])
            if line.startswith("lease = "):
                self._key = json.loads(answer)["lease"]
        elif line.startswith("print_distance(create)"):
            self.said.append(f"DistanceTraveled: {self._get('DistanceTraveled')} mm")
        elif found := re.search(r"packet = get_value\(create, '(\w+)'\);", line):
            packet = self._get(found[1])
            self.said.append(f"packet {packet['ID']}: " + words(base64.b64decode(packet["Data"])))
        elif "pause(" in line:
            time.sleep(float(re.search(r"pause\((.*)\)", line)[1]))

    def _post(self, path, body, key):
        key = self._key if key == "key" else ""
        body = json.dumps(body, separators=(",", ":"))
        done = subprocess.run(self._curl % (key, body, self._create + path), shell=True, capture_output=True, text=True, timeout=WITHIN)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def _get(self, member):
        with urllib.request.urlopen(f"{self._create}/{member}", timeout=WITHIN) as answer:
            return json.load(answer)


def test_the_requests_of_the_matlab_client_drive_the_robot(tmp_path):
    with running_service(tmp_path) as (port, sent):
        gateway, port = gateway_of_the_example(tmp_path, f"rr+tcp://127.0.0.1:{port}/?service=Create")
        try:
            script = MatlabScript(f"http://127.0.0.1:{port}")
            script.run()
            told = sent(lambda lines: len(lines) >= 3 + len(told_by("mjs")))
        finally:
            gateway.stop()
    before, packets, _, after = split(script.said)
    assert (before, after, len(packets)) == (0, 100, 5)
    assert packets[-1] == "packet 19: 7 0 19 0 0 20 0 0 18 0"
    assert told[3:] == [words(command) for command in told_by("mjs")]


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
            {"asked": "play_callback", "count": 1},
            {"call": "Drive", "args": [{"int16": 0}, {"int16": 0}]}])  # it does not leave before its answer is heard
        assert done["results"][-2]["value"] == {"list": [[0, 0]]}
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
