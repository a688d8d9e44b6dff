"""Nodes of the reference on this machine, found through the file system: when they start, end and crash."""
import getpass
import json
import os
import pathlib
import urllib.request

import pytest

from found_nodes import OURS, THEIRS, TYPE, Watch
from network import run
from processes import BUILD, Background, free_port

NAME = "local.theirs"


@pytest.fixture
def start(tmp_path):
    running = []

    def start_process(*command):
        running.append(Background(command, tmp_path / f"{len(running)}.log"))
        return running[-1]

    yield start_process
    for process in running:
        process.stop()


def offer(start, name=NAME):
    node = start(*THEIRS, "serve-local", name)
    return node, json.loads(node.next_line())["id"]


def is_ours(node_id):
    return lambda event: event["id"] == node_id


def test_a_node_of_the_reference_comes_crashes_and_comes_back(start):
    watch = Watch(start(OURS, "watch", "local"))
    node, node_id = offer(start)
    event = watch.wait_for(is_ours(node_id))
    assert (event["event"], event["name"]) == ("found", NAME)
    assert event["urls"] == [f"rr+local:///?nodeid={node_id}&service=RobotRaconteurServiceIndex"]
    node.process.kill()
    node.process.wait()
    watch.wait_for(lambda event: event["id"] == node_id and event["event"] == "lost")
    again, same_id = offer(start)
    assert same_id == node_id  # kept for its name
    watch.wait_for(lambda event: event["id"] == node_id and event["event"] == "found")
    done = run(OURS, "find-type", TYPE, "local")
    (service,) = json.loads(done.stdout.splitlines()[-1])["found"]
    assert (service["node"], service["name"]) == (NAME, "thing")
    again.process.stdin.close()
    assert again.process.wait(10) == 0
    watch.wait_for(lambda event: event["id"] == node_id and event["event"] == "lost")


@pytest.fixture
def public_base():
    """What the administrator makes for users who may offer public nodes."""
    base = pathlib.Path(os.environ["ROBOTRACONTEUR_SYSTEM_PREFIX"]) / "var/run/robotraconteur/transport/local" / getpass.getuser()
    base.mkdir(parents=True, exist_ok=True)
    return base


def test_public_nodes_are_found_and_used_both_ways(start, public_base):
    watch = Watch(start(OURS, "watch", "local"))
    theirs = start(*THEIRS, "serve-local", "public.theirs", "public")
    node_id = json.loads(theirs.next_line())["id"]
    event = watch.wait_for(is_ours(node_id))
    assert event["urls"] == [f"rr+local://{public_base.name}@localhost/?nodeid={node_id}&service=RobotRaconteurServiceIndex"]
    url = f"rr+local://{public_base.name}@localhost/?nodeid={node_id}&service=thing"
    assert json.loads(run(OURS, "call", url).stdout) == {"one": 1}

    ours = start(OURS, "serve-public", "public.ours")
    node_id = json.loads(ours.next_line())["id"]
    watch.wait_for(is_ours(node_id))
    done = run(*THEIRS, "call-local", f"rr+local://{public_base.name}@localhost/?nodename=public.ours&service=thing")
    assert json.loads(done.stdout) == {"one": 1}, done.stderr


def test_the_gateway_makes_a_device_of_it(start, tmp_path):
    port = free_port()
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({"listen": [f"127.0.0.1:{port}"], "devices": [], "retry": {"min_ms": 100, "online_ms": 500},
                                  "discover": {"allow": [{"service_type": TYPE}], "scopes": ["node_local"]}}))
    node, node_id = offer(start, "local.device")
    gateway = start(BUILD / "server" / "rrgate", "serve", "--config", config)

    def ask(what):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/{what}", timeout=5) as answer:
            return json.load(answer)

    def devices():
        try:
            return ask("devices")["devices"]
        except OSError:  # it does not listen yet
            return None

    gateway.wait_until(lambda: (found := devices()) and found[0]["state"] == "online")
    (device,) = devices()
    assert (device["name"], device["found"]) == ("local.device", True)
    assert device["services"] == [{"name": "thing", "type": TYPE, "implements": []}]
    (found,) = [each for each in ask("discovery")["nodes"] if each["node_id"] == node_id]
    assert (found["device"], found["urls"][0]["url"].split("?")[0]) == ("local.device", "rr+local:///")
    node.process.kill()
    gateway.wait_until(lambda: devices() == [])
