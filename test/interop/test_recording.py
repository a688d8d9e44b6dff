"""Recordings: of a device of the real package, read by the mcap package, and replayed to the real package."""
import base64
import csv
import io
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy
import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

from command_line import shown_on_terminal
from gateways import RRGATE, Gateway
from processes import BUILD, ROOT, Background, free_port

REPLAY_DEADLINE = 20.0  # seconds


def rrgate(*arguments, code=0):
    done = subprocess.run([RRGATE, *map(str, arguments)], capture_output=True, text=True, timeout=60)
    assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
    return done.stdout if code == 0 else done.stderr


def wait_for(is_so, seconds=REPLAY_DEADLINE):
    deadline = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < deadline, "not within the deadline"
        time.sleep(0.02)


def messages(path):
    """(topic, time stamp in ns, document) of each message, as the mcap package reads them."""
    with open(path, "rb") as file:
        return [(channel.topic, message.publish_time, json.loads(message.data))
                for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)]


@pytest.fixture(scope="module")
def create(tmp_path_factory):
    port = free_port()
    robot = Background([BUILD / "examples" / "demo" / "rrgate-demo-create", "--port", port],
                       tmp_path_factory.mktemp("create") / "log")
    url = f"rr+tcp://127.0.0.1:{port}/?service=Create"
    robot.wait_until(lambda: subprocess.run([RRGATE, "info", url], capture_output=True).returncode == 0)
    yield url
    robot.stop()


@pytest.fixture
def device(tmp_path):
    """One of the real package."""
    port = free_port()
    process = Background([sys.executable, ROOT / "test" / "interop" / "peers" / "recorded_device.py", port], tmp_path / "log")
    process.next_line()
    yield f"rr+tcp://127.0.0.1:{port}/?service=device"
    process.stop()


@pytest.fixture(scope="module")
def of_create(node, create, tmp_path_factory):
    """A recording of the robot that drives an arc."""
    path = tmp_path_factory.mktemp("recording") / "create.mcap"
    recording = subprocess.Popen([RRGATE, "record", create, "-o", str(path), "--duration", "2", "--interval", "0.25"])
    driver = node.ConnectService(create)  # the robot stops when it goes
    driver.Drive(200, 500)
    assert recording.wait(30) == 0
    node.DisconnectService(driver)
    return path


class Replay:
    """rrgate replay, and the service that controls it."""

    def __init__(self, node, folder, path, *more):
        self.process = Background([RRGATE, "replay", path, *more], folder / "replay.log")
        self.url = self.process.next_line().removeprefix("rrgate replay: ")
        self.control = node.ConnectService(self.url.split("?")[0] + "?service=replay")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        assert self.process.stop() == 0


def test_a_recording_is_an_mcap_file_as_its_own_package_reads_it(of_create):
    with open(of_create, "rb") as file:
        summary = make_reader(file).get_summary()
    topics = {channel.topic: channel for channel in summary.channels.values()}
    assert {"/Create/state", "/Create/packets", "/Create/DistanceTraveled", "/Create/Bump"} <= set(topics)
    counts = summary.statistics.channel_message_counts
    assert counts[topics["/Create/state"].id] > 20 and counts[topics["/Create/DistanceTraveled"].id] >= 4
    found = messages(of_create)
    assert len(found) == summary.statistics.message_count == sum(counts.values())
    states = [document["value"] for topic, _, document in found if topic == "/Create/state"]
    assert states[0].keys() >= {"x", "y", "heading"} and states[-1]["x"] != states[0]["x"]


def test_services_are_recorded_by_their_type_and_by_the_name_of_a_gateways_device(create, tmp_path):
    gateway = Gateway(tmp_path, {"devices": [{"name": "robot", "url": create, "mode": "shared"}]})
    try:
        gateway.wait_for("device online", device="robot")
        base = f"http://127.0.0.1:{gateway.port}"
        node = create.split("?")[0]
        for number, words in enumerate(([f"{base}/devices/robot"], [base, "--type", "experimental.create2.Create"],
                                        [node, "--type", "experimental.create2.Create"],
                                        [create, "--type", "experimental.create2.Create"])):
            file = tmp_path / f"{number}.mcap"
            rrgate("record", *words, "-o", file, "--duration", 1)
            assert "/Create/state" in {topic for topic, _, _ in messages(file)}
        other = create.replace("service=Create", "service=Other")  # the URL says which of the node's services
        said = rrgate("record", other, "--type", "experimental.create2.Create", "-o", tmp_path / "none.mcap", code=3)
        assert "no service of type experimental.create2.Create" in said and not (tmp_path / "none.mcap").exists()
        said = rrgate("record", base, "--type", "com.example.Arm", "-o", tmp_path / "none.mcap", code=3)
        assert "no service of type com.example.Arm" in said and not (tmp_path / "none.mcap").exists()
        assert "--type" in rrgate("record", "-o", tmp_path / "none.mcap", code=2)
    finally:
        gateway.process.stop()


def test_a_page_of_the_dashboard_means_its_service_or_its_device(create, device, tmp_path):
    gateway = Gateway(tmp_path, {"devices": [{"name": "robot", "url": create, "mode": "shared"},
                                             {"name": "other", "url": device, "mode": "shared"}]})
    try:
        gateway.wait_for("device online", device="robot")
        gateway.wait_for("device online", device="other")
        base = f"http://127.0.0.1:{gateway.port}"
        of_type = ["--type", "experimental.create2.Create"]

        def recorded(*words):
            file = tmp_path / "a.mcap"
            rrgate("record", *words, "-o", file, "--duration", 0.2, "--force")
            return [service["name"] for service in json.loads(rrgate("info", file, "--json"))["services"]]

        for page in "robot/Create", "robot/Create?view=members", "robot":
            assert recorded(f"{base}/#/devices/{page}") == recorded(f"{base}/#/devices/{page}", *of_type) == ["Create"]
        assert recorded(f"{base}/#/devices/other/device") == recorded(f"{base}/devices/other") == ["device"]
        for page in "other", "other/device":
            said = rrgate("record", f"{base}/#/devices/{page}", *of_type, "-o", tmp_path / "none.mcap", code=3)
            assert "no service of type experimental.create2.Create" in said
        said = rrgate("record", f"{base}/devices/robot?service=None", *of_type, "-o", tmp_path / "none.mcap", code=3)
        assert "no service of type" in said
        said = rrgate("record", f"{base}/#/devices/other/device/axes/3", "-o", tmp_path / "none.mcap", code=2)
        assert "is the page of an object" in said
    finally:
        gateway.process.stop()


def test_each_message_is_what_its_schema_says(of_create):
    import jsonschema
    with open(of_create, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            text = schema.data.decode()
            assert '"$ref"' not in text and '"oneOf"' not in text
            jsonschema.validate(json.loads(message.data), json.loads(text))


def test_a_file_that_was_cut_is_read_up_to_where_it_ends(of_create, tmp_path):
    whole, bytes_of_it = messages(of_create), of_create.read_bytes()
    cut, counts = tmp_path / "cut.mcap", []
    for part in (0.3, 0.4, 0.5, 0.6):  # the rest is the summary
        cut.write_bytes(bytes_of_it[:int(len(bytes_of_it) * part)])
        found, channels = [], {}
        try:
            for record in StreamReader(open(cut, "rb")).records:
                if isinstance(record, Channel):
                    channels[record.id] = record.topic
                if isinstance(record, Message):
                    found.append((channels[record.channel_id], record.publish_time, json.loads(record.data)))
        except (McapError, EOFError):
            pass  # it says that the end is missing
        assert found == whole[:len(found)]
        told = json.loads(rrgate("info", cut, "--json"))
        assert told["messages"] >= len(found) and "ends at byte" in told["cut"]
        counts.append(told["messages"])
    assert counts == sorted(counts) and counts[0] > 0
    assert json.loads(rrgate("info", of_create, "--json"))["cut"] is None


def test_the_real_package_sees_a_replay_as_it_was(node, of_create, tmp_path):
    """Values of wires in their order and with their time stamps, each of them; properties as they were.

    Step by step: while a handler of a wire runs, the package keeps only the newest of the values that come.
    """
    sent = messages(of_create)
    recorded = {topic: [(stamp, document["value"]) for name, stamp, document in sent if name == topic]
                for topic in ("/Create/state", "/Create/packets", "/Create/DistanceTraveled")}
    with Replay(node, tmp_path, of_create, "--paused") as replay:
        robot = node.ConnectService(replay.url)
        states, packets = [], []

        def follow(wire, seen, value_of):
            connection = wire.Connect()
            connection.WireValueChanged += lambda _, value, at: seen.append((at.seconds * 10**9 + at.nanoseconds, value_of(value)))
            return connection

        def state_of(value):
            return {name: getattr(value, name) for name in recorded["/Create/state"][0][1]}

        connections = [follow(robot.state, states, state_of), follow(robot.packets, packets, lambda value: {
            "ID": value.ID, "Data": base64.b64encode(bytes(value.Data)).decode()})]
        seen = {"/Create/state": states, "/Create/packets": packets}
        for topic, _, _ in sent:
            before = len(seen.get(topic, ()))
            replay.control.step(1)
            if topic in seen:
                wait_for(lambda: len(seen[topic]) > before)
        assert states == recorded["/Create/state"]
        assert packets == recorded["/Create/packets"]
        assert robot.DistanceTraveled == recorded["/Create/DistanceTraveled"][-1][1]
        with pytest.raises(Exception, match="is not in the recording: this is a replay"):
            robot.Drive(100, 100)
        for connection in connections:
            connection.Close()


def test_a_replay_is_steered_by_any_client(node, of_create, tmp_path):
    states = [document["value"] for name, _, document in messages(of_create) if name == "/Create/state"]
    with Replay(node, tmp_path, of_create, "--paused", "--speed", "50") as replay:
        base = replay.url.split("?")[0]
        control = base + "?service=replay"
        duration = json.loads(rrgate("get", control, "state", "--json"))["duration"]
        rrgate("call", control, "seek", duration)
        assert json.loads(rrgate("get", replay.url, "state", "--json"))["x"] == pytest.approx(states[-1]["x"], abs=0.05)
        rrgate("call", control, "seek", "0")
        assert "has no value yet" in rrgate("get", replay.url, "state", code=5)
        assert "has no value yet" in rrgate("get", replay.url, "DistanceTraveled", code=5)
        rrgate("call", control, "seek", "0.5")
        rrgate("call", control, "step", "1")
        told = json.loads(rrgate("get", control, "state", "--json"))
        assert 0.5 <= told["position"] < 0.8 and told["speed"] == 50 and told["playing"] is False
        rrgate("set", control, "loop", "true")
        rrgate("call", control, "play")
        assert len(rrgate("watch", replay.url, "state", "--count", "200").splitlines()) == 200


def test_a_device_of_the_real_package_is_recorded_and_replayed_to_its_client(node, device, tmp_path):
    """Pipes, events, properties, and the wire of an object below the root."""
    path = tmp_path / "device.mcap"
    recording = Background([RRGATE, "record", device, "-o", path, "--members", "*,axes/3/*", "--interval", "0.1"], tmp_path / "record.log")

    def recorded(topic):
        table = subprocess.run([RRGATE, "export", path, "--csv", "--member", topic], capture_output=True, text=True).stdout
        return max(0, table.count("\n") - 1)

    wait_for(lambda: recorded("gain") > 0)
    for number in (1, 2, 3):
        rrgate("call", device, "tell", number)
    wait_for(lambda: recorded("said") == 3)
    recording.process.send_signal(signal.SIGINT)
    assert recording.process.wait(10) == 0
    recording.stop()
    found = messages(path)
    said = [document for topic, _, document in found if topic == "/device/said"]
    assert said == [{"text": 'hello, "you"', "number": number} for number in (1, 2, 3)]
    angles = [(stamp, document["value"]) for topic, stamp, document in found if topic == "/device/axes/3/angle"]
    with Replay(node, tmp_path, path, "--paused") as replay:
        client, heard, poses, turned = node.ConnectService(replay.url), [], [], []
        client.said += lambda text, number: heard.append({"text": text, "number": number})

        def receive(endpoint):
            while endpoint.Available:
                pose = endpoint.ReceivePacket()
                poses.append((list(pose.position), pose.name))

        client.poses.Connect(-1).PacketReceivedEvent += receive
        wire = client.get_axes(3).angle.Connect()
        wire.WireValueChanged += lambda _, value, at: turned.append((at.seconds * 10**9 + at.nanoseconds, value))
        replay.control.play()
        wait_for(lambda: len(heard) == 3 and len(poses) == 3 and len(turned) == len(angles))
        assert heard == said
        assert poses == [([number, 0.5, -1e-300], f"pose \u00e4 {number}") for number in (1, 2, 3)]
        assert turned == angles and [value for _, value in angles] == [0.1, 0.2, pytest.approx(0.3)]
        wait_for(lambda: client.gain == 3)


def test_a_replay_stands_behind_a_gateway_as_the_device_did(node, of_create, tmp_path):
    with Replay(node, tmp_path, of_create, "--loop") as replay:
        gateway = Gateway(tmp_path, {"devices": [{"name": "create", "url": replay.url, "mode": "shared"}]})
        gateway.wait_for("device online")
        url = f"http://127.0.0.1:{gateway.port}/devices/create?service=Create"
        assert len(rrgate("watch", url, "state", "--count", "3").splitlines()) == 3
        gateway.process.stop()


def test_a_member_is_exported_as_a_table(of_create, tmp_path):
    states = [(stamp, document["value"]) for name, stamp, document in messages(of_create) if name == "/Create/state"]
    header, *rows = csv.reader(io.StringIO(rrgate("export", of_create, "--csv", "--member", "state")))
    assert header[0] == "time" and set(header[1:]) == {f"/{name}" for name in states[0][1]}
    assert [{name[1:]: float(cell) for name, cell in zip(header[1:], row[1:])} for row in rows] == [
        {name: float(number) for name, number in state.items()} for _, state in states]
    assert rows[0][0].endswith(f".{states[0][0] % 10**9:09d}Z")
    rrgate("export", of_create, "--csv", "--member", "/Create/DistanceTraveled", "-o", tmp_path / "way.csv")
    assert (tmp_path / "way.csv").read_text().startswith("time,value\n")
    assert "--member takes one of: " in rrgate("export", of_create, "--csv", code=2)
    assert "no one member 'nonesuch'" in rrgate("export", of_create, "--csv", "--member", "nonesuch", code=2)
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(of_create.read_bytes())
    (tmp_path / "link.mcap").symlink_to(copy)
    for output in copy, tmp_path / "link.mcap":
        assert "is the recording itself" in rrgate("export", copy, "--csv", "--member", "state", "-o", output, code=2)
    assert copy.read_bytes() == of_create.read_bytes()


def test_who_waits_for_an_export_sees_how_far_it_is(node, own_service, tmp_path):
    """Into a pipe whose reader takes his time after the first piece."""
    _, url = own_service
    path, pipe = tmp_path / "long.mcap", tmp_path / "pipe"
    recording = subprocess.Popen([RRGATE, "record", url, "-o", path, "--members", "state"], stderr=subprocess.DEVNULL)
    device = node.ConnectService(url)
    wait_for(lambda: device.publish_state(numpy.random.rand(2000)) or (path.is_file() and path.stat().st_size > 500_000))
    recording.send_signal(signal.SIGINT)
    assert recording.wait(REPLAY_DEADLINE) == 0
    node.DisconnectService(device)
    os.mkfifo(pipe)

    def read_slowly():
        with open(pipe, "rb", buffering=0) as file:
            file.read(1)
            time.sleep(0.5)
            while file.read(1_000_000):
                pass

    for form in "--csv", "--json":
        reader = threading.Thread(target=read_slowly)
        reader.start()
        shown = shown_on_terminal("export", path, form, "--member", "state", "-o", pipe)
        reader.join()
        assert re.search(r"exporting \[#*\.+\] +\d+ %", shown) and shown.endswith("\r\x1b[K"), shown


def test_a_member_is_exported_as_json(of_create, tmp_path):
    states = [document["value"] for name, _, document in messages(of_create) if name == "/Create/state"]
    rows = [json.loads(line) for line in rrgate("export", of_create, "--json", "--member", "state").splitlines()]
    table = csv.reader(io.StringIO(rrgate("export", of_create, "--csv", "--member", "state")))
    assert [row["value"] for row in rows] == states
    assert [row["time"] for row in rows] == [row[0] for row in table][1:]
    assert "excludes" in rrgate("export", of_create, "--csv", "--json", "--member", "state", code=2)
    assert "expected --csv or --json" in rrgate("export", of_create, "--member", "state", code=2)


def test_what_was_recorded_is_told_as_json(create, tmp_path):
    path = tmp_path / "short.mcap"
    told = json.loads(rrgate("record", create, "-o", path, "--members", "state", "--duration", "0.5", "--json"))
    assert told["file"] == str(path) and told["messages"] == len(messages(path)) > 0
    assert told["members"] == 1 and told["seconds"] >= 0.5 and told["bytes"] == path.stat().st_size


def test_a_long_recording_goes_on_in_further_files_and_the_oldest_go(create, tmp_path):
    rrgate("record", create, "-o", tmp_path / "run.mcap", "--members", "state", "--duration", "3", "--max-size", "0.008", "--keep", "2")
    files = sorted(tmp_path.glob("run*.mcap"))
    assert len(files) == 2 and all(file.name != "run.mcap" for file in files)
    assert all(len(messages(file)) > 0 for file in files)


def test_the_files_of_a_recording_are_described_exported_and_replayed_as_one(create, node, tmp_path):
    rrgate("record", create, "-o", tmp_path / "run.mcap", "--members", "state", "--duration", "3", "--max-size", "0.008")
    files = sorted(tmp_path.glob("run*.mcap"), key=lambda file: messages(file)[0][1])
    each = [[document["value"] for _, _, document in messages(file)] for file in files]
    assert len(files) > 2 and files[0].name == "run.mcap"
    shuffled = [files[-1], *files[:-1]]
    told = json.loads(rrgate("info", *shuffled, "--json"))
    assert told["files"] == [str(file) for file in files] and told["file"] == f"{files[0]} to {files[-1]}"
    assert told["messages"] == sum(map(len, each)) and 2 < told["seconds"] < 4
    assert told["services"][0]["members"][0]["messages"] == told["messages"]
    lines = rrgate("export", *shuffled, "--json", "--member", "state").splitlines()
    assert [json.loads(line)["value"] for line in lines] == sum(each, [])
    with Replay(node, tmp_path, shuffled[0], *shuffled[1:], "--paused") as replay:
        assert abs(replay.control.state.PeekInValue()[0].duration - told["seconds"]) < 1e-6
        replay.control.step(told["messages"])
        last = node.ConnectService(replay.url).state.PeekInValue()[0]
        assert last.x == each[-1][-1]["x"]
    twice = rrgate("replay", files[1], files[0], files[1], code=1)
    assert f"{files[1]}: is given twice" in twice


def test_a_size_that_definitions_exceed_is_told_and_files_hold_messages_all_the_same(create, tmp_path):
    done = subprocess.run([RRGATE, "record", create, "-o", tmp_path / "run.mcap", "--members", "state", "--duration", "2",
                           "--max-size", "0.001"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0 and "--max-size 0.001: files become 0.0" in done.stderr, done
    counts = [len(messages(file)) for file in sorted(tmp_path.glob("run*.mcap"))]
    assert max(counts) > 5 and len(counts) < sum(counts) / 2


def test_a_recording_ends_while_its_service_has_not_answered(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        silent.settimeout(REPLAY_DEADLINE)
        url = f"rr+tcp://127.0.0.1:{silent.getsockname()[1]}/?service=a"
        recording = subprocess.Popen([RRGATE, "record", url, "-o", tmp_path / "a.mcap"], stderr=subprocess.PIPE, text=True)
        with silent.accept()[0] as client:
            client.settimeout(REPLAY_DEADLINE)
            assert client.recv(1)  # it opens a session
            recording.send_signal(signal.SIGINT)
            said = recording.communicate(timeout=REPLAY_DEADLINE)[1]
    assert recording.returncode == 0 and said.startswith("0 messages of 0 members"), said
    assert messages(tmp_path / "a.mcap") == []  # the file is complete


def test_what_an_interrupted_recording_was_to_replace_is_kept(create, tmp_path):
    path, before = tmp_path / "a.mcap", tmp_path / "a.mcap.before"
    path.write_text("the interrupted one")
    before.write_text("the former one")
    said = rrgate("record", create, "-o", path, "--force", "--duration", "0.2", code=2)
    assert f"{before} is there" in said and "move it away" in said
    assert (path.read_text(), before.read_text()) == ("the interrupted one", "the former one")
    before.unlink()
    rrgate("record", create, "-o", path, "--force", "--duration", "0.2")
    assert messages(path) and list(tmp_path.iterdir()) == [path]


def test_mistakes_are_told(create, of_create, tmp_path):
    path = tmp_path / "a.mcap"
    assert "is there already; --force replaces it" in rrgate("record", create, "-o", of_create, "--duration", "1", code=2)
    assert "Connection refused" in rrgate("record", f"rr+tcp://127.0.0.1:{free_port()}/?service=a", "-o", path, code=3)
    assert "/no/such/a.mcap: can't be written: No such file" in rrgate("record", create, "-o", "/no/such/a.mcap", code=1)
    told = rrgate("record", create, "-o", path, "--members", "nonesuch", code=2)
    assert "'nonesuch': no member to record; " in told and "DistanceTraveled" in told
    assert not path.exists()
    path.write_text("no recording")
    assert "Connection refused" in rrgate("record", f"rr+tcp://127.0.0.1:{free_port()}/?service=a", "-o", path, "--force", code=3)
    assert path.read_text() == "no recording" and sorted(tmp_path.iterdir()) == [path]
    for command in ("info", "replay"):
        assert "is no MCAP file: begins with" in rrgate(command, path, code=1)
    assert "can't be read: No such file" in rrgate("info", tmp_path / "none.mcap", code=1)
