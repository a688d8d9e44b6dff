"""Recordings that a gateway makes of the simulated robot, asked for by HTTP. Tests import the fixtures that they use."""
import time

import pytest

from gateways import Gateway
from http_api import ask
from processes import BUILD, Background, free_port

API = "/api/v1/recordings"


def make_create(folder, port=None):
    port = port or free_port()
    robot = Background([BUILD / "examples" / "demo" / "rrgate-demo-create", "--port", port], folder / "create.log")
    robot.next_line()
    return robot, f"rr+tcp://127.0.0.1:{port}/?service=Create", port


@pytest.fixture(scope="module")
def create(tmp_path_factory):
    robot, url, _ = make_create(tmp_path_factory.mktemp("create"))
    yield url
    robot.stop()


@pytest.fixture
def begin_gateway(tmp_path):
    gateways = []

    def begin(url, recordings={}, mode="shared", command=(), **more):
        gateways.append(Gateway(tmp_path, {
            "devices": [{"name": "create", "url": url, "mode": mode}], "retry": {"min_ms": 100, "max_ms": 200, "online_ms": 500},
            "recordings": {"folder": "recordings", **recordings}, **more}, command=command))
        gateways[-1].wait_for("device online", device="create")
        return gateways[-1]

    yield begin
    for gateway in gateways:
        gateway.process.stop()


def wait_for(look, is_so, seconds=20):
    deadline = time.monotonic() + seconds
    while not is_so(seen := look()):
        assert time.monotonic() < deadline, seen
        time.sleep(0.05)
    return seen


def begin(gateway, status=201, headers={}, **wish):
    answer = ask(gateway.port, "POST", API, {"device": "create", "service": "Create", **wish}, headers)
    assert answer.status == status, answer.body
    return answer.json


def look(gateway, recording):
    answer = ask(gateway.port, "GET", f"{API}/{recording['name']}")
    assert answer.status == 200
    return answer.json


def listed(gateway, headers={}):
    return ask(gateway.port, "GET", API, headers=headers).json["recordings"]


def stop(gateway, recording):
    answer = ask(gateway.port, "POST", f"{API}/{recording['name']}/stop")
    assert (answer.status, answer.json["state"]) == (200, "ended")
    return answer.json
