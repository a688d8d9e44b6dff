"""Recordings that the gateway plays: devices that say what was recorded, to whom who may know of it."""
import json
import shutil
import time

from golden_recording import DEADLINE, FILE, MESSAGES, plain, write_later
from http_api import ask
from json_sockets import Socket
from recordings import API, begin_gateway, create, listed, wait_for  # noqa: F401 (fixtures)
from users import basic, make_users

NAME = "create.Create.20261125T083000123Z"
DEVICE = f"replay~{NAME}"
DEVICES = "/api/v1/devices"
STATES = [(stamp, value) for kind, member, stamp, value in MESSAGES if member == "state"]


def put_recordings(gateway, *names):
    folder = gateway.file.parent / "recordings"
    folder.mkdir(exist_ok=True)
    for name in names:
        shutil.copy(FILE, folder / f"{name}.mcap")
    return folder


def play(gateway, name=NAME, status=201, headers={}):
    answer = ask(gateway.port, "POST", f"{API}/{name}/play", headers=headers)
    assert answer.status == status, answer.body
    return answer


def end(gateway, name=NAME, status=204, headers={}):
    answer = ask(gateway.port, "DELETE", f"{API}/{name}/play", headers=headers)
    assert answer.status == status, answer.body


def devices(gateway, headers={}):
    return {each["name"]: each for each in ask(gateway.port, "GET", DEVICES, headers=headers).json["devices"]}


def replays(gateway):
    """Of the one recording, and of each of its files."""
    [recording] = listed(gateway)
    return [recording["replay"], *(each["replay"] for each in recording["files"])]


def wait_until_online(gateway, device=DEVICE):
    return wait_for(lambda: devices(gateway).get(device), lambda seen: seen and seen["state"] == "online" and seen["services"])


def is_in_order(part, whole):
    """Newest wins: what comes is some of it."""
    left = iter(whole)
    return all(each in left for each in part)


def test_a_recording_that_is_played_is_a_device_that_says_so(create, begin_gateway):
    gateway = begin_gateway(create)
    write_later(put_recordings(gateway, NAME) / f"{NAME}-2.mcap", 60)
    answer = play(gateway)
    assert answer.json == {"device": DEVICE} and answer.headers["Location"] == f"{DEVICES}/{DEVICE}"
    seen = wait_until_online(gateway)
    assert (seen["recording"], seen["mode"], seen["found"], seen["served"]) == (NAME, "shared", False, False)
    assert {each["name"] for each in seen["services"]} >= {"Create", "replay"}
    assert devices(gateway)["create"]["recording"] is None
    assert play(gateway, status=200).json == {"device": DEVICE}
    second = play(gateway, f"{NAME}-2.mcap").json["device"]
    assert second == f"{DEVICE}-2" and wait_until_online(gateway, second)["recording"] == NAME
    assert replays(gateway) == [DEVICE, None, second]
    end(gateway, f"{NAME}-2.mcap")
    assert devices(gateway).keys() == {"create", DEVICE}
    end(gateway)
    end(gateway)
    assert devices(gateway).keys() == {"create"} and replays(gateway) == [None, None, None]
    assert play(gateway, f"{NAME}.mcap").json["device"] == f"{DEVICE}-1"
    assert replays(gateway) == [None, f"{DEVICE}-1", None]
    end(gateway)
    assert replays(gateway) == [None, None, None]
    play(gateway, f"{NAME}-3.mcap", 404)
    play(gateway, "create.Create.20200101T000000000Z", 404)


def test_http_hears_what_was_recorded_with_its_time_stamps(create, begin_gateway):
    gateway = begin_gateway(create)
    put_recordings(gateway, NAME)
    play(gateway)
    wait_until_online(gateway)
    heard = []
    with Socket(gateway.port, f"{DEVICES}/{DEVICE}/Create") as socket:
        number = socket.open("subscribe", "state")
        while not heard or heard[-1][0] < STATES[-1][0]:
            news = socket.next(subscription=number)
            heard.append((int(news["time"]["seconds"]) * 10**9 + news["time"]["nanoseconds"], news["value"]))
    assert is_in_order(heard, STATES) and heard[-1] == STATES[-1]
    refused = ask(gateway.port, "POST", f"{DEVICES}/{DEVICE}/Create/Drive", {"velocity": 1, "radius": 1})
    assert refused.status == 501 and refused.json["detail"].endswith(f"this is a replay of {NAME}.mcap")
    assert ask(gateway.port, "GET", f"{DEVICES}/{DEVICE}/replay/file").json == f"{NAME}.mcap"  # and not where it is
    assert ask(gateway.port, "POST", API, {"device": DEVICE, "service": "Create"}).status == 409  # it is recorded already


def test_a_recording_of_several_files_is_one_time_line(create, begin_gateway):
    gateway = begin_gateway(create)
    write_later(put_recordings(gateway, NAME) / f"{NAME}-2.mcap", 60)
    play(gateway)
    wait_until_online(gateway)
    replay, state = f"{DEVICES}/{DEVICE}/replay", f"{DEVICES}/{DEVICE}/Create/state"
    assert ask(gateway.port, "GET", f"{replay}/file").json == f"{NAME}.mcap to {NAME}-2.mcap"
    told = ask(gateway.port, "GET", f"{replay}/state").json
    assert 60 < told["duration"] < 120
    for position in 60, 0, told["duration"]:
        assert ask(gateway.port, "POST", f"{replay}/pause", {}).status == 200
        assert ask(gateway.port, "POST", f"{replay}/seek", {"position": position}).status == 200
        at = ask(gateway.port, "GET", f"{replay}/state").json["position"]
        assert abs(at - position) < 1e-6
    assert ask(gateway.port, "POST", f"{replay}/step", {"messages": 1}).status == 200
    assert ask(gateway.port, "GET", state).json == STATES[-1][1]


def test_the_real_package_hears_what_was_recorded_and_goes_to_another_time(create, begin_gateway, node):
    gateway = begin_gateway(create)
    put_recordings(gateway, NAME)
    play(gateway)
    wait_until_online(gateway)
    url = f"rr+ws://127.0.0.1:{gateway.port}/devices/{DEVICE}?service="
    robot, control = node.ConnectService(url + "Create"), node.ConnectService(url + "replay")
    try:
        heard = []
        wire = robot.state.Connect()
        wire.WireValueChanged += lambda _, value, at: heard.append((at.seconds * 10**9 + at.nanoseconds, plain(value)))
        deadline = time.monotonic() + DEADLINE
        while not heard or heard[-1][0] < STATES[-1][0]:
            assert time.monotonic() < deadline, heard[-3:]
            time.sleep(0.02)
        assert is_in_order(heard, STATES) and heard[-1] == STATES[-1]
        control.seek(2)
        first = wait_for(lambda: heard[-1], lambda last: last[1] != STATES[-1][1])
        assert first[0] > STATES[-1][0]  # what is older than the last would not be heard
        control.step(1)
        wire.Close()
    finally:
        for each in (robot, control):
            node.DisconnectService(each)


def test_the_gateways_own_node_leads_to_the_robot_alone(create, begin_gateway, node):
    gateway = begin_gateway(create, mode="relay")  # so that the name of its service is free there
    put_recordings(gateway, NAME)
    play(gateway)
    wait_until_online(gateway)
    index = node.ConnectService(f"rr+ws://127.0.0.1:{gateway.port}/gateway?service=RobotRaconteurServiceIndex")
    try:
        assert {each.Name for each in index.GetLocalNodeServices().values()}.isdisjoint({"Create", "replay"})
        assert len(index.GetRoutedNodes()) == 1
    finally:
        node.DisconnectService(index)


RULES = [{"roles": ["viewer"], "devices": ["create"], "may": ["read", "subscribe"]},
         {"roles": ["operator"], "devices": ["create"], "services": ["Create"], "may": ["record"]},
         {"roles": ["admin"], "devices": ["other", "replay*"], "may": ["read", "subscribe", "call", "record"]}]


def test_rights_are_those_to_the_device_that_was_recorded(create, begin_gateway, tmp_path):
    make_users(tmp_path)
    gateway = begin_gateway(create, access={"users_file": "users", "rules": RULES}, audit={"file": "audit"})
    put_recordings(gateway, NAME)
    vera, alice, root = (basic(name) for name in ("vera", "alice", "root"))
    play(gateway, status=401)
    for stranger in vera, root:
        play(gateway, status=403, headers=stranger)
    play(gateway, headers=alice)
    wait_for(lambda: devices(gateway, alice).get(DEVICE), lambda seen: seen and seen["services"])
    assert [each["name"] for each in devices(gateway, vera)[DEVICE]["services"] if not each["name"].startswith("Robot")] == ["Create"]
    assert devices(gateway, root) == {} and ask(gateway.port, "GET", DEVICES).status == 401

    def status(path, headers, method="GET", body=None):
        return ask(gateway.port, method, f"{DEVICES}/{DEVICE}/{path}", body, headers).status

    wait_for(lambda: status("Create/state", vera), lambda seen: seen == 200)
    assert [status("Create/state", who) for who in (alice, root, {})] == [403, 403, 401]
    seek = ("replay/seek", "POST", {"position": 1})
    assert [status(seek[0], who, *seek[1:]) for who in (vera, root, {})] == [403, 403, 401]
    assert status(seek[0], alice, *seek[1:]) == 200
    for who, told in (vera, 403), (root, 403), ({}, 401):
        end(gateway, status=told, headers=who)
    end(gateway, headers=alice)
    assert status("Create/state", vera) == 404

    def done():
        records = [json.loads(line) for line in (tmp_path / "audit").read_text().splitlines()]
        return [(each["event"], each["user"], each["outcome"]) for each in records if each["event"].startswith("recording_play")]

    assert wait_for(done, lambda seen: len(seen) >= 2) == [("recording_played", "alice", "ok"), ("recording_play_ended", "alice", "ok")]


def test_four_are_played_and_who_wants_a_fifth_hears_of_those_that_he_may_end(create, begin_gateway, tmp_path):
    make_users(tmp_path)
    rules = [{"roles": ["operator"], "devices": ["create"], "may": ["record"]}, {"roles": ["admin"], "may": ["record"]}]
    gateway = begin_gateway(create, access={"users_file": "users", "rules": rules})
    names = [f"{device}.Create.2026112{day}T083000123Z" for day in range(1, 4) for device in ("create", "arm")]
    put_recordings(gateway, *names)
    root, alice = basic("root"), basic("alice")
    for name in names[:4]:
        play(gateway, name, headers=root)
    refused = play(gateway, names[4], 409, alice).json["detail"]
    assert refused == f"as many recordings are played as may be (4): replay~{names[0]}, replay~{names[2]} and 2 of others"
    end(gateway, names[0], headers=alice)
    play(gateway, names[4], headers=alice)


def test_what_is_played_ends_with_its_recording_with_its_folder_and_with_the_gateway(create, begin_gateway):
    gateway = begin_gateway(create)
    others = [f"create.Create.2026112{day}T083000123Z" for day in range(1, 4)]
    folder = put_recordings(gateway, NAME, *others)
    for name in (NAME, *others):
        play(gateway, name)
        wait_until_online(gateway, f"replay~{name}")
    assert ask(gateway.port, "DELETE", f"{API}/{NAME}").status == 204
    assert DEVICE not in devices(gateway)
    (folder / f"{others[0]}.mcap").unlink()
    wait_for(lambda: devices(gateway), lambda seen: f"replay~{others[0]}" not in seen)
    gateway.write({**gateway.config, "timeouts": {"connect_ms": 4000}})
    gateway.hang_up()
    gateway.wait_for("configuration read anew")
    assert f"replay~{others[1]}" in devices(gateway)
    gateway.write({**gateway.config, "recordings": {"folder": "elsewhere"}})
    gateway.hang_up()
    wait_for(lambda: devices(gateway).keys(), lambda seen: seen == {"create"})
    gateway.write(gateway.config)
    gateway.hang_up()
    wait_for(lambda: ask(gateway.port, "POST", f"{API}/{others[2]}/play").status, lambda seen: seen == 201)
    assert gateway.process.stop() == 0


def test_a_file_that_is_damaged_is_refused_and_what_is_still_recorded_is_played_as_far_as_it_goes(create, begin_gateway):
    gateway = begin_gateway(create)
    folder = put_recordings(gateway, NAME)
    file = folder / f"{NAME}.mcap"
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xff
    file.write_bytes(data)
    refused = play(gateway, status=409).json["detail"]
    assert refused.startswith(f"{NAME}.mcap: chunk at byte") and "CRC" in refused
    recording = ask(gateway.port, "POST", API, {"device": "create", "service": "Create", "interval_ms": 100}).json
    wait_for(lambda: ask(gateway.port, "GET", f"{API}/{recording['name']}").json["bytes"], lambda seen: seen > 30_000)
    device = play(gateway, recording["name"]).json["device"]
    wait_until_online(gateway, device)
    state = f"{DEVICES}/{device}/Create/state"
    assert "x" in wait_for(lambda: ask(gateway.port, "GET", state), lambda seen: seen.status == 200).json
