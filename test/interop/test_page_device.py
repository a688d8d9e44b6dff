"""A page that is a device: its service through the gateway, for clients of all kinds; how it comes and goes, and who may."""
import contextlib
import json

import pytest
import RobotRaconteur as RR
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from clients import JS, check_all, run_client
from directions import RELAYED, Direction
from gateways import running
from http_api import fetch
from processes import Background
from scenarios import FUNCTIONS, SCENARIOS
from users import basic, make_users

PROTOCOL = "rrgate.serve.v1"
RAW_PROTOCOL = "robotraconteur.robotraconteur.com"
# Steps of users, which a page does not know, and of locks, which it gives to nobody.
GUARDED = {"open", "login", "lock", "enter"}
OFFERED = [each for each in SCENARIOS if "ours" in each.services and not any(GUARDED & step.keys() for step in each.steps)]
# A relay reads nothing of what passes.
WAYS = [Direction("reference-shared-page", "reference", "gateway-shared-tcp", "ours", "v4"),
        Direction("node-shared-page", "node", "gateway-shared-ws", "ours", "v4"),
        Direction("ours-relayed-page", "ours", "gateway-ws", "ours", "v4", RELAYED)]
CASES = [(way, scenario) for way in WAYS for scenario in OFFERED if way.knows(scenario)]


class Page:
    """A page, but for Node in its place, that is a device."""

    def __init__(self, folder, gateway, name, **options):
        command = ["node", JS / "page.mjs", f"http://127.0.0.1:{gateway.port}", name, json.dumps(options)]
        self.process = Background(command, folder / f"page-{name}.log")

    def news(self):
        return json.loads(self.process.next_line())


@contextlib.contextmanager
def served(folder, gateway, name="interop", **options):
    page = Page(folder, gateway, name, **options)
    try:
        assert page.news() == {"served": True, "reason": ""}
        gateway.wait_for("device online", device=name)
        yield page
    finally:
        page.process.stop()


def with_pages(folder, serve={}, **config):
    return running(folder, {"devices": [], "serve": serve, **config})


def devices(gateway, **options):
    status, _, body = fetch(gateway.port, "/api/v1/devices", **options)
    assert status == 200
    return {each["name"]: each for each in json.loads(body)["devices"]}


def control(gateway, name, **options):
    return connect(f"ws://127.0.0.1:{gateway.port}/serve/{name}", subprotocols=[PROTOCOL], **options)


def told(page, name):
    """What the gateway tells a page on that socket; in which order is not said."""
    return next(message[name] for message in iter(lambda: json.loads(page.recv(10)), None) if name in message)


def refusal(gateway, name, **options):
    """Why a page may not be this device: a page can read how a WebSocket closes."""
    with control(gateway, name, **options) as page, pytest.raises(ConnectionClosed) as closed:
        page.recv(10)
    assert closed.value.rcvd.code == 1008
    return closed.value.rcvd.reason


@pytest.fixture(scope="module")
def way(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    mode = "shared" if request.param.is_shared else "relay"
    with with_pages(folder, {"mode": mode}) as gateway, served(folder, gateway):
        yield request.param, gateway


@pytest.mark.parametrize("way, offered", CASES, indirect=["way"], ids=[f"{way.name}-{each.name}" for way, each in CASES])
def test_a_page_answers_clients_of_all_kinds(way, offered):
    direction, gateway = way
    check_all(offered.steps, run_client(direction, gateway.port, offered))


def test_a_page_comes_and_goes_with_its_device(tmp_path):
    with with_pages(tmp_path) as gateway:
        with served(tmp_path, gateway):
            (device,) = devices(gateway).values()
            assert (device["name"], device["url"], device["mode"]) == ("interop", "page://interop/", "shared")
            assert (device["state"], device["served"], device["found"]) == ("online", True, False)
            assert (device["node_name"], device["services"][0]["type"]) == ("interop", "experimental.interop.Interop")
        gateway.wait_for("page is no device any more", device="interop")
        assert devices(gateway) == {}
        # The name is free again.
        with served(tmp_path, gateway):
            assert set(devices(gateway)) == {"interop"}


def test_a_page_that_is_killed_is_gone_at_once_for_its_clients(tmp_path, node):
    with with_pages(tmp_path) as gateway, served(tmp_path, gateway) as page:
        url = f"rr+ws://127.0.0.1:{gateway.port}/devices/interop?service=interop"
        root = node.ConnectService(url)
        assert root.add(1.0, 2.0) == 3.0
        page.process.process.kill()
        gateway.wait_for("page is no device any more", device="interop")
        with pytest.raises(RR.RobotRaconteurException):
            root.add(1.0, 2.0)
        with pytest.raises(RR.RobotRaconteurException):
            node.ConnectService(url)
        assert devices(gateway) == {}


def test_a_page_is_the_device_again_once_the_gateway_is_back(tmp_path):
    with with_pages(tmp_path) as gateway, served(tmp_path, gateway) as page:
        node_id = devices(gateway)["interop"]["node_id"]
        gateway.process.stop()
        lost = page.news()
        assert lost["served"] is False and "the gateway is stopping" in lost["reason"]
        gateway.start()
        while not page.news()["served"]:
            pass  # told of each attempt
        gateway.wait_for("device online", device="interop")
        assert devices(gateway)["interop"]["node_id"] == node_id


def test_who_may_be_a_device_and_who_may_use_it(tmp_path):
    make_users(tmp_path)
    rules = [{"roles": ["operator"], "devices": ["phone-*"], "may": ["serve"]},
             {"roles": ["viewer"], "devices": ["phone-*"], "may": ["read"]}]
    with with_pages(tmp_path, access={"users_file": "users", "rules": rules}) as gateway:
        assert refusal(gateway, "phone-1") == "who is not logged in may not serve device 'phone-1'"
        assert "'vera' (viewer) may not serve device 'phone-1'" in refusal(gateway, "phone-1", additional_headers=basic("vera"))
        assert "may not serve device 'arm'" in refusal(gateway, "arm", additional_headers=basic("alice"))
        with served(tmp_path, gateway, "phone-1", headers=basic("alice")):
            assert set(devices(gateway, headers=basic("vera"))) == {"phone-1"}
            # To serve it is no right to use it.
            assert devices(gateway, headers=basic("alice")) == {}
            # The user of the page loses the right: the device goes.
            gateway.write({**gateway.config, "access": {"users_file": "users", "rules": rules[1:]}})
            gateway.hang_up()
            gateway.wait_for("page is no device any more", device="phone-1")
            assert devices(gateway, headers=basic("vera")) == {}


def test_pages_that_are_refused(tmp_path):
    with with_pages(tmp_path, {"max_devices": 2}) as gateway:
        with control(gateway, "one") as one, control(gateway, "two") as two:
            assert told(one, "served") == "one" and told(two, "served") == "two"
            assert refusal(gateway, "one") == "there is a device 'one' already"
            assert refusal(gateway, "three") == "as many pages are devices as may be (2)"
            assert refusal(gateway, "a%20b").startswith("name of a device: ")
            assert refusal(gateway, "x" * 80).startswith("name of a device: ")


def test_a_gateway_without_pages_says_so(tmp_path):
    with running(tmp_path, {"devices": []}) as gateway:
        page = Page(tmp_path, gateway, "phone")
        try:
            assert 'the configuration of the gateway has no "serve"' in page.news()["error"]
        finally:
            page.process.stop()


def test_a_page_of_another_origin_is_refused(tmp_path):
    with with_pages(tmp_path) as gateway:
        with pytest.raises(InvalidStatus) as refused:
            control(gateway, "phone", origin="http://elsewhere.example").__enter__()
        assert refused.value.response.status_code == 403


def test_a_page_that_never_answers_is_no_device_for_long(tmp_path):
    with with_pages(tmp_path, timeouts={"connect_ms": 500}) as gateway, served(tmp_path, gateway, "good"):
        with control(gateway, "silent") as silent:
            assert told(silent, "open")
            with pytest.raises(ConnectionClosed) as closed:
                while True:
                    silent.recv(10)
        assert closed.value.rcvd.reason == "the page opened no connection in time"
        gateway.wait_for("page is no device any more", device="silent")
        assert set(devices(gateway)) == {"good"}


def test_a_page_that_talks_garbage_harms_nobody(tmp_path):
    with with_pages(tmp_path) as gateway, served(tmp_path, gateway):
        with control(gateway, "noise") as noise:
            key = told(noise, "open")
            with connect(f"ws://127.0.0.1:{gateway.port}/serve/noise?key={key}", subprotocols=[RAW_PROTOCOL]) as link:
                link.send(b"RRACnonsense" * 100)
            offline = gateway.wait_for("device offline", device="noise")
            assert offline["error"]
            # What it says where it has nothing to say ends it.
            noise.send("{}")
            with pytest.raises(ConnectionClosed) as closed:
                while True:
                    noise.recv(10)
            assert closed.value.rcvd.reason == "a page has nothing to say here"
        check_all(FUNCTIONS.steps, run_client(WAYS[0], gateway.port, FUNCTIONS))


def test_a_connection_that_nobody_has_asked_for_is_refused(tmp_path):
    with with_pages(tmp_path) as gateway, served(tmp_path, gateway):
        for name in ("interop", "other"):
            url = f"ws://127.0.0.1:{gateway.port}/serve/{name}?key=guessed"
            with connect(url, subprotocols=[RAW_PROTOCOL]) as link, pytest.raises(ConnectionClosed) as closed:
                link.recv(10)
            assert closed.value.rcvd.reason == "nobody has asked for this connection, or waits for it any more"
        assert devices(gateway)["interop"]["state"] == "online"
