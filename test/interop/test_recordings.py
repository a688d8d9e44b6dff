"""Recordings that the gateway makes: by its configuration and by HTTP, read by the mcap package; who may, and what goes wrong."""
import http.client
import io
import json

import pytest
from mcap.reader import make_reader

from http_api import ask
from machine import need
from recordings import API, begin, begin_gateway, create, listed, look, make_create, stop, wait_for  # noqa: F401 (fixtures)
from users import basic, make_users


def messages(gateway, recording):
    """(topic, document) of each message of all files."""
    found = []
    for file in recording["files"]:
        answer = ask(gateway.port, "GET", f"{API}/{file['name']}")
        assert (answer.status, answer.headers["Content-Type"]) == (200, "application/octet-stream")
        assert file["name"] in answer.headers["Content-Disposition"]
        found += [(channel.topic, json.loads(message.data)) for _, channel, message in
                  make_reader(io.BytesIO(answer.body), validate_crcs=True).iter_messages(log_time_order=False)]
    return found


@pytest.mark.parametrize("mode", ["shared", "relay"])
def test_a_device_is_recorded_by_the_gateways_own_session(create, begin_gateway, mode):
    gateway = begin_gateway(create, mode=mode)
    recording = begin(gateway, interval_ms=100)
    assert recording["state"] in ("waiting", "recording")  # it may have all that it wants by now
    assert (recording["device"], recording["service"]) == ("create", "Create")
    seen = wait_for(lambda: look(gateway, recording), lambda seen: seen["messages"] > 40)
    assert (seen["state"], seen["problem"], seen["standing"]) == ("recording", None, False)
    ended = stop(gateway, recording)
    assert ended["seconds"] > 0.3 and ended["bytes"] == sum(file["bytes"] for file in ended["files"]) > 1000
    assert listed(gateway) == [look(gateway, recording)] == [ended]
    found = messages(gateway, ended)
    assert len(found) == ended["messages"]
    states = [document["value"] for topic, document in found if topic == "/Create/state"]
    assert len(states) > 5 and states[0].keys() >= {"x", "y", "heading"}
    assert len([1 for topic, _ in found if topic == "/Create/DistanceTraveled"]) >= 3
    assert ask(gateway.port, "POST", f"{API}/{recording['name']}/stop").json == ended  # again: as it is
    assert ask(gateway.port, "DELETE", f"{API}/{recording['name']}").status == 204
    assert listed(gateway) == [] and not list((gateway.file.parent / "recordings").iterdir())
    assert ask(gateway.port, "GET", f"{API}/{ended['files'][0]['name']}").status == 404


def test_a_device_whose_name_looks_like_the_end_of_a_time_is_recorded_too(create, begin_gateway):
    gateway = begin_gateway(create, devices=[{"name": name, "url": create, "mode": "shared"} for name in ("create", "AZ-1")])
    recording = begin(gateway, device="AZ-1")
    wait_for(lambda: look(gateway, recording), lambda seen: seen["messages"] > 5)
    ended = stop(gateway, recording)
    assert [file["name"] for file in ended["files"]] == [recording["name"] + ".mcap"] and messages(gateway, ended)
    assert ask(gateway.port, "DELETE", f"{API}/{recording['name']}").status == 204
    assert not list((gateway.file.parent / "recordings").iterdir())


def test_only_what_is_wanted_is_recorded_and_ends_by_itself(create, begin_gateway):
    gateway = begin_gateway(create)
    recording = begin(gateway, members=["state"], seconds=1)
    assert ask(gateway.port, "DELETE", f"{API}/{recording['name']}").status == 409  # under way
    ended = wait_for(lambda: look(gateway, recording), lambda seen: seen["state"] == "ended")
    assert {topic for topic, _ in messages(gateway, ended)} == {"/Create/state"}
    refused = begin(gateway, members=["Drive"])
    failed = wait_for(lambda: look(gateway, refused), lambda seen: seen["state"] == "failed")
    assert "no member to record" in failed["problem"] and failed["files"] == []


def test_what_makes_no_sense_is_refused(create, begin_gateway):
    gateway = begin_gateway(create, {"at_once": 1})
    for wish in ({"members": []}, {"members": [1]}, {"interval_ms": 0}, {"seconds": "1"}, {"device": ""}, {"service": "../x"}):
        assert begin(gateway, 400, **wish)["status"] == 400
    begin(gateway, 404, device="nobody")
    for name in ("create.Create.20261125T083000123Z", "..%2fgateway.json", "x", "create.Create.20261125T083000123Z.mcap"):
        assert ask(gateway.port, "GET", f"{API}/{name}").status == 404
        assert ask(gateway.port, "DELETE", f"{API}/{name}").status == 404
    begin(gateway, service="")  # there is one
    assert "under way already" in begin(gateway, 507)["detail"]


def test_a_device_that_goes_and_comes_is_recorded_on(begin_gateway, tmp_path):
    robot, url, port = make_create(tmp_path)
    gateway = begin_gateway(url)
    try:
        recording = begin(gateway)
        seen = wait_for(lambda: look(gateway, recording), lambda seen: seen["messages"] > 10)
        robot.stop()
        wait_for(lambda: look(gateway, recording), lambda seen: seen["problem"])
        robot, _, _ = make_create(tmp_path, port)
        back = wait_for(lambda: look(gateway, recording), lambda now: now["messages"] > seen["messages"] + 50 and not now["problem"])
        assert back["state"] == "recording"
        assert len(messages(gateway, stop(gateway, recording))) > seen["messages"] + 50
    finally:
        robot.stop()


def test_the_configuration_wants_recordings_in_several_files(create, begin_gateway):
    wish = {"device": "create", "service": "Create", "interval_ms": 10, "max_file_bytes": 30_000, "kept_files": 2}
    gateway = begin_gateway(create, {"record": [wish]})
    [standing] = wait_for(lambda: listed(gateway), lambda seen: seen and len(seen[0]["files"]) == 2 and seen[0]["messages"] > 1000)
    assert standing["standing"] and not standing["files"][0]["name"].endswith("Z.mcap")  # the first has gone
    assert ask(gateway.port, "POST", f"{API}/{standing['name']}/stop").status == 409
    config = {**gateway.config, "recordings": {"folder": "recordings"}}
    gateway.write(config)
    gateway.hang_up()
    [ended] = wait_for(lambda: listed(gateway), lambda seen: seen[0]["state"] == "ended")
    assert messages(gateway, ended)


def test_a_ring_of_files_goes_on_over_restarts_of_the_gateway(create, begin_gateway):
    wish = {"device": "create", "service": "Create", "interval_ms": 10, "max_file_bytes": 30_000, "kept_files": 2}
    gateway = begin_gateway(create, {"record": [wish]})
    client = begin(gateway, members=["state"])
    stop(gateway, client)
    files = lambda: {file["name"] for each in listed(gateway) for file in each["files"] if each["name"] != client["name"]}
    before = wait_for(files, lambda seen: len(seen) == 2)
    gateway.process.stop()
    gateway.start()
    wait_for(files, lambda seen: not seen & before and len(seen) == 2)
    assert len(look(gateway, client)["files"]) == 1  # what a client has recorded stays


def test_files_are_whole_when_the_gateway_stops_and_readable_when_it_is_killed(create, begin_gateway):
    gateway = begin_gateway(create)
    first = begin(gateway)
    wait_for(lambda: look(gateway, first), lambda seen: seen["messages"] > 30)
    gateway.process.stop()
    gateway.start()
    [ended] = listed(gateway)
    assert (ended["name"], ended["state"], ended["messages"]) == (first["name"], "ended", None)
    assert ended["seconds"] > 0 and len(messages(gateway, ended)) > 30
    second = begin(gateway)
    wait_for(lambda: look(gateway, second), lambda seen: seen["bytes"] > 10_000)
    gateway.process.process.kill()
    gateway.process.stop()
    gateway.start()
    cut = next(each for each in listed(gateway) if each["name"] == second["name"])
    answer = ask(gateway.port, "GET", f"{API}/{cut['files'][0]['name']}")
    assert (answer.status, answer.body[1:5]) == (200, b"MCAP")
    assert len(answer.body) > 10_000


def test_what_recordings_may_take_is_bounded_and_the_gateway_goes_on(create, begin_gateway, tmp_path):
    gateway = begin_gateway(create, {"max_bytes": 1_000_000})
    (tmp_path / "recordings").mkdir(exist_ok=True)
    (tmp_path / "recordings" / "old.Dev.20200101T000000000Z.mcap").write_bytes(b"x" * 995_000)
    recording = begin(gateway, interval_ms=10)
    failed = wait_for(lambda: look(gateway, recording), lambda seen: seen["state"] == "failed")
    assert "all that they may" in failed["problem"]
    assert failed["problem"] == gateway.wait_for("recording failed", recording=recording["name"])["error"]
    assert "all that they may" in begin(gateway, 507)["detail"]
    assert ask(gateway.port, "GET", "/api/v1/devices/create/Create/DistanceTraveled").status == 200
    assert ask(gateway.port, "DELETE", f"{API}/old.Dev.20200101T000000000Z").status == 204
    begin(gateway)


def test_a_disk_that_is_full_ends_the_recording_alone(create, begin_gateway, tmp_path):
    need("mount-namespaces")
    folder = tmp_path / "recordings"
    folder.mkdir()
    script = 'mount -t tmpfs -o size=128k full "$1" && shift && exec "$@"'
    gateway = begin_gateway(create, {"record": [{"device": "create", "service": "Create", "interval_ms": 10}]},
                            command=["unshare", "-m", "--propagation", "private", "sh", "-c", script, "sh", folder])
    [failed] = wait_for(lambda: listed(gateway), lambda seen: seen and seen[0]["state"] == "failed")
    assert "No space left" in failed["problem"]
    assert failed["problem"] == gateway.wait_for("recording failed", recording=failed["name"])["error"]
    assert "No space left" in begin(gateway, 507)["detail"]
    assert ask(gateway.port, "GET", "/api/v1/devices/create/Create/DistanceTraveled").status == 200


def test_a_download_that_can_not_be_read_to_its_end_breaks_off(create, begin_gateway, tmp_path):
    need("mount-namespaces")
    (tmp_path / "recordings").mkdir()
    file = tmp_path / "recordings" / "old.Dev.20200101T000000000Z.mcap"
    file.touch()
    script = 'mount --bind /proc/$$/mem "$1" && shift && exec "$@"'  # a file whose first byte can't be read
    gateway = begin_gateway(create, command=["unshare", "-m", "--propagation", "private", "sh", "-c", script, "sh", file])
    with pytest.raises(http.client.IncompleteRead):
        ask(gateway.port, "GET", f"{API}/{file.name}")


def test_who_has_the_right_to_record_alone_may(create, begin_gateway, tmp_path):
    rules = [{"roles": ["viewer"], "may": ["read", "subscribe"]},
             {"roles": ["operator"], "devices": ["create"], "services": ["Create"], "may": ["read", "record"]},
             {"roles": ["admin"], "may": ["read", "record", "admin"]}]
    make_users(tmp_path)
    gateway = begin_gateway(create, access={"users_file": "users", "rules": rules}, audit={"file": "audit"})
    vera, alice, root = (basic(name) for name in ("vera", "alice", "root"))
    begin(gateway, 403, vera)
    begin(gateway, 401)
    begin(gateway, 403, alice, service="Other")
    recording = begin(gateway, headers=alice)
    file = f"{API}/{recording['name']}.mcap"
    for path, method in ((f"{API}/{recording['name']}", "GET"), (file, "GET"), (f"{API}/{recording['name']}/stop", "POST"),
                         (f"{API}/{recording['name']}", "DELETE"), (f"{API}/create.Create.20200101T000000000Z", "GET")):
        assert ask(gateway.port, method, path, headers=vera).status == 403
    assert listed(gateway, vera) == [] and [each["name"] for each in listed(gateway, root)] == [recording["name"]]
    assert ask(gateway.port, "GET", file, headers=alice).status == 200
    assert ask(gateway.port, "POST", f"{API}/{recording['name']}/stop", headers=root).status == 200
    assert ask(gateway.port, "DELETE", f"{API}/{recording['name']}", headers=alice).status == 204

    def done():
        records = [json.loads(line) for line in (tmp_path / "audit").read_text().splitlines()]
        return [(each["event"], each["user"], each["outcome"]) for each in records if each["event"].startswith("recording_")]

    # A thread of its own writes them.
    assert wait_for(done, lambda seen: len(seen) >= 4) == [("recording_begun", "alice", "ok"), ("recording_downloaded", "alice", "ok"),
                                                           ("recording_stopped", "root", "ok"), ("recording_deleted", "alice", "ok")]
