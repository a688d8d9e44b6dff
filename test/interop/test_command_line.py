"""The commands of rrgate that use a device, against Reynard the Robot: directly, and through a gateway."""
import datetime
import itertools
import json
import math
import re
import select
import socket
import subprocess
import sys
import time

import pytest
import RobotRaconteur as RR

from command_line import DEVICE_ERROR, DONE, FAILED, NOT_UNDERSTOOD, REFUSED, UNREACHABLE, Ran, complete, run, shown_on_terminal
from directions import PEERS
from found_nodes import THEIRS, TYPE
from gateways import RRGATE, Gateway, running
from processes import BUILD, Background, free_port
from shared_sites import Site, start_service
from tap import Tap
from users import PASSWORDS, make_users


@pytest.fixture(scope="module", params=["directly", "shared", "relay"])
def url(request, reynard, tmp_path_factory):
    if request.param == "directly":
        yield reynard
        return
    gateway = Gateway(tmp_path_factory.mktemp("gateway"),
                      {"node": {"name": "lab.gateway"},
                       "devices": [{"name": "fox", "url": reynard, "mode": request.param}]})
    gateway.wait_for("device online")
    yield f"http://127.0.0.1:{gateway.port}/devices/fox?service=reynard"
    gateway.process.stop()


def test_values_are_read_written_and_called(url):
    run("set", url, "color", "[0.25, 0.5, 1]")
    assert run("get", url, "color") == "[0.25,0.5,1.0]"
    assert run("set", url, "color", "-", given="[1, 0, 0.5]") == ""
    assert json.loads(run("set", url, "color", "[1, 0, 0.5]", "--json")) == [1.0, 0.0, 0.5]
    assert json.loads(run("get", url, "color", "--json")) == [1.0, 0.0, 0.5]
    assert run("call", url, "say", "hello there") == ""
    assert run("call", url, "say", "--", "-5 degrees") == ""
    run("call", url, "setf_arm_position", "q2=-0.5", "q1=0.25", "0.125")
    assert json.loads(run("call", url, "getf_arm_position")) == pytest.approx([0.25, -0.5, 0.125])
    assert set(json.loads(run("get", url, "state", "--json"))) >= {"time", "robot_position", "arm_position"}


@pytest.mark.parametrize("way", ["directly", "gateway", "gateway with users"])
def test_a_robot_of_the_standard_types_is_jogged(standard_robot, way, tmp_path):
    url, login, gateway, access = standard_robot, {}, None, {}
    if way == "gateway with users":
        make_users(tmp_path)
        access = {"access": {"users_file": "users", "rules": [{"roles": ["operator"], "may": ["read", "subscribe", "write", "call"]}]}}
        login = {"environment": {"RRGATE_PASSWORD": PASSWORDS["alice"]}}
    if way != "directly":
        gateway = Gateway(tmp_path, {"devices": [{"name": "arm", "url": standard_robot, "mode": "shared"}], **access})
        gateway.wait_for("device online")
        url = f"http://127.0.0.1:{gateway.port}/devices/arm?service=robot"

    def rrgate(*arguments):
        return run(*arguments, *(["--user", "alice"] if login else []), **login)

    def wait_for_state(is_wanted):  # the driver's answer comes before its last step
        deadline = time.monotonic() + 10
        while not is_wanted(state := json.loads(rrgate("watch", url, "robot_state", "--count", "1", "--json"))["value"]):
            assert time.monotonic() < deadline, state

    try:
        services = map(json.loads, rrgate("ls", url.split("/devices/" if gateway else "?")[0], "--json").splitlines())
        listed = next(each for each in services if each["service"] == "robot")
        assert listed["type"] == "com.robotraconteur.robotics.robot.Robot"
        assert json.loads(rrgate("get", listed["url"], "robot_info", "--json"))["joint_info"][1]["joint_limits"]["upper"] > 0
        assert rrgate("get", listed["url"], "command_mode") == "halt"  # as people read it
        assert "com.robotraconteur.robotics.robot.Robot" in rrgate("info", url)
        assert "function void halt() [urgent]" in rrgate("info", url, "halt")
        for mode in "halt", "jog":  # words of an enum
            rrgate("set", url, "command_mode", mode)
            wait_for_state(lambda state, mode=mode: state["command_mode"] == mode)
        for target in [0.5, -0.25], [0, 0.125]:
            rrgate("call", url, "jog_freespace", json.dumps(target), "max_velocity=[2, 2]", "wait=true")
            wait_for_state(lambda state, target=target: state["joint_position"] == pytest.approx(target, abs=0.05))
        packets = rrgate("watch", url, "robot_state_sensor_data", "--count", "3", "--json").splitlines()
        assert [json.loads(each)["value"]["robot_state"]["command_mode"] for each in packets] == ["jog"] * 3
        rrgate("set", url, "command_mode", "halt")
        refusal = Ran(["call", url, "jog_freespace", "[0, 0]", "[9, 9]", "true", *(["--user", "alice"] if login else [])],
                      **login)
        assert refusal.refused(DEVICE_ERROR, "not in jog mode")
    finally:
        if gateway:
            gateway.process.stop()


def test_an_argument_may_be_a_file(reynard, tmp_path):
    file = tmp_path / "color.json"
    file.write_text("[0.5, 0.25, 0]")
    run("set", reynard, "color", f"@{file}")
    assert json.loads(run("get", reynard, "color")) == [0.5, 0.25, 0.0]
    assert Ran(["set", reynard, "color", "@nowhere"]).refused(NOT_UNDERSTOOD, "'nowhere'")


@pytest.fixture
def interop(tmp_path):
    """The test service, directly."""
    service, url = start_service(tmp_path)
    yield url
    service.stop()


def test_a_line_end_is_no_part_of_what_is_read(interop, tmp_path):
    def is_refused(member, file, *words):
        return Ran(["set", interop, member, f"@{file}"]).refused(NOT_UNDERSTOOD, "file '/", *words)

    run("set", interop, "p_color", "-", given="blue\n")
    assert run("get", interop, "p_color") == "blue"
    file = tmp_path / "text"
    for written, read in (b"red", "red"), (b"red\r\n", "red"), (b"two\n\n", "two\n"), (b'"quoted\\n"\n', "quoted\n"), (b"\n", ""):
        file.write_bytes(written)
        run("set", interop, "p_string", f"@{file}")
        assert json.loads(run("get", interop, "p_string", "--json")) == read
    file.write_bytes(b"M\xfcller\n")
    assert is_refused("p_string", file, "is not UTF-8")
    file.write_bytes(b"many\n")
    assert is_refused("p_double", file, "is not JSON")
    assert Ran(["set", interop, "p_double", "-"], given="many").refused(NOT_UNDERSTOOD, "standard input is not JSON")


def test_what_a_service_has_is_told(url):
    text = run("info", url)
    assert "reynard: experimental.reynard_the_robot.Reynard" in text
    assert "  function void teleport(double x, double y)" in text
    assert "  wire ReynardState state [readonly]" in text
    told = json.loads(run("info", url, "color", "--json"))
    assert [member["kind"] for member in told["members"]] == ["property"]
    assert "wire ReynardState state [readonly]" in run("robdef", url)
    definitions = {each["name"]: each["text"] for each in json.loads(run("robdef", url, "--json"))}
    assert "wire ReynardState state [readonly]" in definitions["experimental.reynard_the_robot"]


def test_documentation_and_attributes_are_told(tmp_path):
    room = Background([BUILD / "examples" / "demo" / "rrgate-demo-conference-room", "--port", free_port()], tmp_path / "log")
    url = room.next_line().split()[1]
    try:
        with running(tmp_path, {"devices": [{"name": "room", "url": url, "mode": "shared"}]}) as gateway:
            gateway.wait_for("device online")
            for where in url, f"http://127.0.0.1:{gateway.port}/devices/room?service=Controller":
                lines = run("info", where).splitlines()
                assert lines[:2] == ["Controller: experimental.conference_room.Controller", "  Holds what the sensors measure at a target."]
                at = lines.index("  property Colour target")
                assert lines[at + 1] == "      In lx, 0 to 1000 of each colour."
                told = {each["name"]: each["documentation"] for each in json.loads(run("info", where, "--json"))["members"]}
                assert told["on"].strip() == "While it is off the lights may be set by hand."
            assert '  attribute rrgate.mode: {"type":"string","value":"shared"}' in lines
    finally:
        room.stop()


def test_locks_of_a_gateways_device_are_told(node, tmp_path):
    site = Site(tmp_path, node, {"login": {"username": "gateway", "password": "secret"}})
    url = f"http://127.0.0.1:{site.port}/devices/interop?service=guarded"

    def locks(*path):
        return json.loads(run("info", url, *path, "--json"))["locks"]

    try:
        assert locks() == []
        tool = site.connect().get_tools(0)
        site.node.RequestObjectLock(tool, RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK)
        held = {"path": "guarded.tools[0]", "kind": "client", "user": ""}
        assert locks() == [held] and locks("tools/0") == [held] and locks("tools/1") == []
        assert "  lock guarded.tools[0]: a client\n" in run("info", url)
        site.node.ReleaseObjectLock(tool)
        assert locks() == []
        arm = site.connect("guarded", "alice")
        site.node.RequestObjectLock(arm, RR.RobotRaconteurObjectLockFlags_USER_LOCK)
        assert locks("tools/0") == [{"path": "guarded", "kind": "user", "user": "alice"}]
        assert "  lock guarded: user alice\n" in run("info", url)
        page = f"http://127.0.0.1:{site.port}/#/devices/interop/guarded"  # what a browser shows there
        for address in (page, page + "?view=board"):
            assert "  lock guarded: user alice\n" in run("info", address)
        assert "locks" not in json.loads(run("info", site.url.split("?")[0] + "?service=plain", "--json"))
    finally:
        site.stop()


def test_values_are_watched(url):
    lines = [json.loads(line) for line in run("watch", url, "state", "--count", "3", "--json").splitlines()]
    times = [line["value"]["time"] for line in lines]
    assert len(times) == 3 and times == sorted(times)
    header, *rows = run("watch", url, "state", "--count", "2", "--csv").splitlines()
    assert header.startswith("time,device_time,age,/arm_position/0,") and len(rows) == 2
    assert {row.count(",") for row in rows} == {header.count(",")}


def test_a_table_has_the_columns_of_the_first_value_with_numbers(tmp_path):
    port = free_port()
    device = Background([sys.executable, PEERS / "growing_lists.py", port], tmp_path / "log")
    try:
        device.next_line()
        ran = Ran(["watch", f"rr+tcp://127.0.0.1:{port}/?service=device", "lists", "--csv", "--count", "3"])
        assert [line.split(",")[1:] for line in ran.out.splitlines()] == [["/0", "/1"], ["", ""], ["1.5", "2.5"], ["3.5", "4.5"]]
        assert ran.code == DONE and ran.error.startswith("numbers without a column: 1; --json has all\n")
    finally:
        device.stop()


def test_rows_without_numbers_are_shown(interop):
    run("call", interop, "publish_state", "[]")
    header, row = run("watch", interop, "state", "--csv", "--count", "1").splitlines()
    assert header == "time,device_time,age,value" and row.endswith(",")
    watching = subprocess.Popen([RRGATE, "watch", interop, "cleared", "--csv"], stdout=subprocess.PIPE, text=True)
    while not select.select([watching.stdout], [], [], 0.1)[0]:
        run("call", interop, "clear")
    assert watching.stdout.readline() == "time,value\n"
    watching.terminate()
    watching.communicate()


def test_what_a_device_only_takes_is_not_watched(interop):
    assert Ran(["watch", interop, "target"]).refused(NOT_UNDERSTOOD, "wire 'target' is writeonly")
    assert Ran(["watch", interop, "taken"]).refused(NOT_UNDERSTOOD, "pipe 'taken' is writeonly")
    offered = complete("watch", interop, "")
    assert {"state", "both", "poses", "changed"} <= set(offered) and not {"target", "taken"} & set(offered)


def test_values_of_wires_have_the_devices_time_and_their_age(url):
    def parse(text):
        return datetime.datetime.fromisoformat(text.replace("Z", "+00:00"))

    line = json.loads(run("watch", url, "state", "--count", "1", "--json"))
    difference = (parse(line["time"]) - parse(line["device_time"])).total_seconds()
    assert line["age"] == pytest.approx(difference, abs=0.0021)  # both times are cut to milliseconds
    assert -0.1 < line["age"] < 5
    _, row = run("watch", url, "state", "--count", "1", "--csv").splitlines()
    time, device_time, age = row.split(",")[:3]
    assert (parse(time) - parse(device_time)).total_seconds() == pytest.approx(float(age), abs=0.0021)
    assert re.match(r"\d\d:\d\d:\d\d\.\d{3}  sent \d\d:\d\d:\d\d\.\d{3}, age -?\d+\.\d{6} s  \{", run("watch", url, "state", "--count", "1"))


def test_events_are_watched(node, tmp_path):
    """The simulated robot drives on until it bumps into something."""
    port = free_port()
    robot = Background([BUILD / "examples" / "demo" / "rrgate-demo-create", "--port", port], tmp_path / "log")
    url = f"rr+tcp://127.0.0.1:{port}/?service=Create"
    try:
        robot.wait_until(lambda: Ran(["get", url, "DistanceTraveled"]).code == DONE)
        watching = subprocess.Popen([RRGATE, "watch", url, "Bump", "--count", "1", "--json"], stdout=subprocess.PIPE,
                                    text=True)
        driver = node.ConnectService(url)  # it stops when the client that drives it goes
        driver.Drive(500, 32767)
        assert json.loads(watching.communicate(timeout=60)[0])["value"] == {}
        assert watching.returncode == DONE
        node.DisconnectService(driver)
    finally:
        robot.stop()


@pytest.fixture
def axes(tmp_path):
    """A device of the real package whose axes come and go; its process and its URL."""
    port = free_port()
    device = Background([sys.executable, PEERS / "recorded_device.py", port], tmp_path / "log")
    device.next_line()
    yield device, f"rr+tcp://127.0.0.1:{port}/?service=device"
    device.stop()


class Watching:
    """rrgate watch, which has shown a value of the axis."""

    def __init__(self, url, member):
        self.process = subprocess.Popen([RRGATE, "watch", url, f"axes/3/{member}", "--json"], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        while not select.select([self.process.stdout], [], [], 0.1)[0]:
            Ran(["call", url, "tell", "1"])  # refused as long as nobody has asked for the axis
        assert "value" in json.loads(self.process.stdout.readline())

    def ended(self):
        """What it says in the end, by itself."""
        said = self.process.communicate(timeout=20)[1]
        assert self.process.returncode == UNREACHABLE, said
        return said


@pytest.mark.parametrize("member", ["angle", "turns", "turned"])
def test_a_watch_ends_with_what_it_watches(axes, member):
    device, url = axes
    watching = Watching(url, member)
    run("call", url, "release_axis")
    assert watching.ended().endswith("the service has closed it\n")
    watching = Watching(url, member)
    device.stop()
    assert re.search(r"the connection was lost: \w", watching.ended())


def test_a_watch_ends_when_nobody_can_hear_of_it(reynard):
    with open("/dev/full", "w") as full:
        watching = subprocess.run([RRGATE, "watch", reynard, "state"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=30)
    assert watching.returncode == FAILED and watching.stderr.endswith("rrgate watch: standard output can't be written\n")


def test_requests_are_timed(url):
    times = json.loads(run("ping", url, "--count", "20", "--json"))
    assert times["count"] == 20
    assert 0 < times["min_ms"] <= times["p50_ms"] <= times["p99_ms"] <= times["max_ms"]
    assert run("ping", url, "--count", "20").startswith("20 requests: min ")
    is_shared = "rrgate.mode" in run("info", url)
    for command in (["ping", url], ["bench", url]):
        assert ("the gateway answers, not the device" in Ran([*command, "--count", "1"]).error) == is_shared
    assert Ran(["bench", url, "color", "--count", "1"]).error == ""


def test_the_times_of_requests_are_counted_by_class(slow_reynard):
    """Each request passes a line that takes 10 ms each way, so none is in a class that ends below 16 ms."""
    for command in (["ping"], ["bench", "--parallel", "1"]):
        summary, *classes = run(command[0], slow_reynard, *command[1:], "--count", "30").splitlines()
        at = dict(zip(("min", "p50", "p99", "max"), map(float, re.fullmatch(
            r"30 requests: min (\S+) ms, p50 (\S+) ms, p99 (\S+) ms, max (\S+) ms", summary).groups())))
        if command[0] == "bench":
            rate = int(re.fullmatch(r"(\d+) /s", classes.pop(0))[1])
            assert 0 < rate <= 1000 / at["min"] + 1
        rows = [re.fullmatch(r" *(\d+\.\d{3}) ms +(\d+) (#+)", row).groups() for row in classes]
        limits, counts, bars = [float(row[0]) for row in rows], [int(row[1]) for row in rows], [len(row[2]) for row in rows]
        assert sum(counts) == 30 and all(counts)
        assert all(16 <= limit == 2 ** round(math.log2(limit)) for limit in limits) and limits == sorted(set(limits))
        assert limits[0] / 2 < at["min"] <= limits[0] and limits[-1] / 2 < at["max"] <= limits[-1]
        assert next(limit for limit, below in zip(limits, itertools.accumulate(counts)) if below > 14) / 2 < at["p50"]
        assert bars == [math.ceil(50 * count / 30) for count in counts]


def test_many_requests_are_timed_side_by_side(url):
    times = json.loads(run("bench", url, "--count", "200", "--parallel", "8", "--json"))
    assert times["count"] == 200 and times["per_second"] > 0
    assert json.loads(run("bench", url, "color", "--count", "20", "--json"))["count"] == 20
    assert Ran(["bench", url, "say", "--count", "20"]).refused(NOT_UNDERSTOOD, "'say' is a function", "property")


@pytest.fixture
def slow_reynard(reynard):
    """Reynard behind a line that takes 10 ms for each piece."""
    def take_time(data):
        time.sleep(0.01)
        return data

    port = reynard.split(":")[2].split("/")[0]
    line = Tap(int(port), take_time)
    yield reynard.replace(f":{port}/", f":{line.port}/")
    line.close()


@pytest.mark.parametrize("command, words", [
    (["ls", "--wait", "1"], r"listening \[#+\.+\]  \d\d %"),
    (["ping", "URL", "--count", "150"], r"asking \[#+\.+\]  \d\d %"),
    (["bench", "URL", "--count", "150", "--parallel", "1"], r"asking \[#+\.+\]  \d\d %")])
def test_who_waits_at_a_terminal_sees_how_far_it_is(slow_reynard, command, words):
    command = [slow_reynard if word == "URL" else word for word in command]
    shown = shown_on_terminal(*command)
    *bars, last = shown.split("\r\x1b[K")
    assert re.search(words, "".join(bars)) and "%" not in last, shown
    assert "%" not in Ran(command).error  # no terminal


def test_who_waits_for_much_to_pass_sees_how_much_it_is(slow_reynard, tmp_path):
    words = tmp_path / "words"
    words.write_text("x" * 8_000_000)
    shown = shown_on_terminal("call", slow_reynard, "say", f"@{words}")
    assert re.search(r"transferring \d+\.\d MB", shown) and shown.endswith("\r\x1b[K"), shown
    assert "transferring" not in shown_on_terminal("call", slow_reynard, "say", "little")


def test_values_go_to_files(reynard, tmp_path):
    run("set", reynard, "color", "[0.5, 0.25, 0]")
    file = tmp_path / "color.json"
    assert run("get", reynard, "color", "-o", file) == "" and json.loads(file.read_text()) == [0.5, 0.25, 0.0]
    assert Ran(["get", reynard, "color", "-o", "/nowhere/color"]).refused(FAILED, "/nowhere/color", "written")
    assert Ran(["get", reynard, "color", "-o", tmp_path / "color.png"]).refused(NOT_UNDERSTOOD, "no image: double[]")


def test_nothing_is_called_whose_result_could_not_be_kept(axes, tmp_path):
    _, url = axes

    def call(output):
        return Ran(["call", url, "tell", "7", "-o", output])

    for output in "/nowhere/pose", tmp_path, f"{tmp_path}/":
        assert call(output).refused(FAILED, f"{output}: can't be written")
    assert call(tmp_path / "pose.png").refused(NOT_UNDERSTOOD, "its value is no image: void")
    assert run("get", url, "gain") == "0" and not (tmp_path / "pose.png").exists()
    run("info", url, "axes/3")  # what it tells needs the axis
    assert call(tmp_path / "pose.json").code == DONE and run("get", url, "gain") == "7"


def test_each_value_of_a_generator_is_a_line_of_the_file(tmp_path):
    service, url = start_service(tmp_path)
    try:
        file = tmp_path / "values.jsonl"
        file.write_text("what was there before\n")
        with running(tmp_path, {"devices": [{"name": "interop", "url": url, "mode": "shared"}], "access": {
                "anonymous_role": "guest", "rules": [{"roles": ["guest"], "may": ["read", "subscribe"]}]}}) as gateway:
            gateway.wait_for("session open", service="interop")
            beside = f"http://127.0.0.1:{gateway.port}/devices/interop?service=interop"
            assert Ran(["call", beside, "count_up", "0.5", "3", "-o", file]).refused(REFUSED, "may not call")
        assert file.read_text() == "what was there before\n"
        assert run("call", url, "count_up", "0.5", "3", "-o", file) == ""
        assert [json.loads(line) for line in file.read_text().splitlines()] == [0.5, 1.5, 2.5]
        assert run("call", url, "count_up", "0.5", "0", "-o", file) == "" and file.read_text() == ""
        assert run("call", url, "count_up", "0.5", "3").splitlines() == ["0.5", "1.5", "2.5"]
        image = tmp_path / "values.png"
        refused = Ran(["call", url, "count_up", "0.5", "3", "-o", image])
        assert refused.refused(NOT_UNDERSTOOD, "'count_up' is a generator", "values.png") and not image.exists()
        assert Ran(["call", url, "count_up", "0.5", "3", "-o", "/nowhere/values"]).refused(FAILED, "/nowhere/values", "written")
    finally:
        service.stop()


def test_images_go_to_files(tmp_path):
    port = free_port()
    cameras = Background([BUILD / "examples" / "demo" / "rrgate-demo-webcams", "--port", port, "--device", "none"], tmp_path / "log")
    url = f"rr+tcp://127.0.0.1:{port}/?service=Webcam"
    try:
        cameras.wait_until(lambda: Ran(["info", url]).code == DONE)
        for name, magic in ("frame.jpg", b"\xff\xd8"), ("frame.png", b"\x89PNG"):
            run("call", url, "Webcams/0/CaptureFrame", "-o", tmp_path / name)
            assert (tmp_path / name).read_bytes().startswith(magic)
    finally:
        cameras.stop()


def test_what_comes_and_goes_is_told():
    name = f"experimental.found.n{free_port()}"
    watching = subprocess.Popen([RRGATE, "ls", "--watch", "--wait", "1", "--json"], stdout=subprocess.PIPE, text=True)
    device = subprocess.Popen([*THEIRS, "serve-local", name], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
    told = (json.loads(line) for line in watching.stdout)
    try:
        found = next(each for each in told if each["node"] == name)
        assert (found["change"], found["service"], found["type"]) == ("found", "thing", TYPE)
        device.communicate()
        assert next(each for each in told if each["node"] == name)["change"] == "lost"
    finally:
        device.kill()
        device.communicate()
        watching.kill()
        watching.communicate()


def test_a_search_that_finds_nothing_says_what_else_to_try():
    ran = Ran(["ls", "--wait", "1", "--type", "experimental.found.Nothing"])
    assert (ran.code, ran.out, ran.error.count("\n")) == (DONE, "", 1)
    assert ran.error.startswith("rrgate ls: found nothing within 1 s") and "rrgate ls http://127.0.0.1:8080" in ran.error


def test_shells_ask_what_may_come(reynard):
    assert complete("che") == ["check-config", "check"]
    assert complete("cert", "") == ["ca", "node", "web"]
    assert "--csv" in complete("watch", reynard, "--c")
    assert complete("get", reynard, "col") == ["color"]
    assert complete("get", "--timeout", "5", reynard, "st") == ["state"]
    assert "teleport" in complete("call", reynard, "") and "color" not in complete("call", reynard, "")
    assert complete("call", reynard, "teleport", "") == ["x=", "y="]
    assert complete("serve", "--config", "") == []


def test_services_are_listed(reynard, url):
    if url == reynard:
        found = json.loads(run("ls", reynard.split("?")[0], "--json"))
        assert (found["node"], found["service"], found["type"]) == \
            ("experimental.reynard_the_robot", "reynard", "experimental.reynard_the_robot.Reynard")
        assert run("get", found["url"], "color").startswith("[")
    else:
        found = json.loads(run("ls", url.split("/devices/")[0], "--json"))
        assert (found["node"], found["service"], found["url"]) == ("fox", "reynard", url)


def test_mistakes_are_one_sentence(url):
    assert Ran(["get", url, "colour"]).refused(NOT_UNDERSTOOD, "no member 'colour'", "it has: ", "color")
    assert Ran(["get", url, "teleport"]).refused(NOT_UNDERSTOOD, "'teleport' is a function", "property")
    assert Ran(["call", url, "teleport", "1"]).refused(NOT_UNDERSTOOD, "'y'", "teleport(double x, double y)")
    assert Ran(["call", url, "teleport", "1", "2", "3"]).refused(NOT_UNDERSTOOD, "3 arguments")
    assert Ran(["call", url, "teleport", "x=1", "x=2"]).refused(NOT_UNDERSTOOD, "'x' is given twice")
    assert Ran(["call", url, "teleport", "far", "away"]).refused(NOT_UNDERSTOOD, "'far' is not JSON")
    assert Ran(["set", url, "color", "red"]).refused(NOT_UNDERSTOOD, "'red' is not JSON")
    assert Ran(["set", url, "robot_position", "[1, 2]"]).refused(NOT_UNDERSTOOD, "readonly")
    assert Ran(["call", url, "teleport", "1e6", "0"]).refused(DEVICE_ERROR, "out of range")
    assert Ran(["watch", url, "color"]).refused(NOT_UNDERSTOOD, "'color' is a property", "wire, pipe, event")


def test_what_is_not_there_is_told_in_time():
    nobody = f"rr+tcp://127.0.0.1:{free_port()}/?service=x"
    assert Ran(["get", nobody, "a"]).refused(UNREACHABLE, "Connection refused")
    with socket.create_server(("127.0.0.1", 0)) as silent:  # takes connections and says nothing
        url = f"rr+tcp://127.0.0.1:{silent.getsockname()[1]}/?service=x"
        began = time.monotonic()
        assert Ran(["get", url, "a", "--timeout", "1"]).refused(UNREACHABLE, url)
        assert time.monotonic() - began < 10
    for url in "lab", "rr+usb:///?service=x", "http://127.0.0.1:1/devices/arm":
        refusal = Ran(["get", url, "a"])
        assert refusal.refused(NOT_UNDERSTOOD, f"rrgate get: {url}: ") and "URL" not in refusal.error, refusal.error
    assert Ran(["get", "rr+tcp://127.0.0.1:1/", "a"]).refused(NOT_UNDERSTOOD, "?service=NAME", "rrgate ls")
    assert Ran(["get", nobody, "a", "--timeout", "never"]).refused(NOT_UNDERSTOOD, "--timeout", "'never'")
