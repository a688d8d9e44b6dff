"""Whoever uses a service of a device through the gateway, in whatever way: to the device they are one session. The device is
one of the real package, and so is the client that speaks Robot Raconteur."""
import time

import pytest
import RobotRaconteur as RR

from http_api import Stream, ask
from json_sockets import Socket
from processes import start_gateway
from shared_sites import RETRY, Site, is_refused, start_arm
from users import basic

PLAIN = "/api/v1/devices/interop/plain"
GUARDED = "/api/v1/devices/interop/guarded"


@pytest.fixture
def site(node, tmp_path):
    made = Site(tmp_path, node)
    yield made
    made.stop()


@pytest.fixture
def relayed(tmp_path):
    """The port of a gateway that relays its device."""
    device, url = start_arm(tmp_path)
    gateway, port = start_gateway(tmp_path, url, retry=RETRY)
    yield port
    gateway.stop()
    device.stop()


def value_of(stream):
    """The next value of a stream of events, behind what it says of the connection."""
    while (event := stream.next())[1] == "state":
        pass
    return event[2]


def test_all_clients_are_one_session_and_hear_of_its_loss_and_return(site):
    root = site.connect("plain")
    stream = Stream(site.port, "/state", base=PLAIN)
    with Socket(site.port, PLAIN) as page, Socket(site.port, PLAIN) as robot:
        states = page.open("subscribe", "state")
        robot.ask("send", "target", value=0.5)
        assert value_of(stream) == 1.0
        assert page.next(subscription=states, value=1.0)
        assert (root.sessions, page.ask("get", "sessions")) == (1, 1)
        assert ask(site.port, "GET", PLAIN + "/sessions").json == 1

        site.device.stop()
        kind, event = stream.next()[1:]
        assert (kind, event["state"]) == ("state", "connection_lost")
        assert event["detail"].startswith("connection_lost: device 'interop': ")
        assert page.next(subscription=states, state="connection_lost")["detail"] == event["detail"]
        assert is_refused(RR.ConnectionException, lambda: root.status)
        assert ask(site.port, "GET", PLAIN + "/status").status == 503
        assert robot.refusal("get", "status")[0] == "ConnectionError"

        site.start_again()
        assert stream.next()[1:] == ("state", {"state": "connected"})
        assert page.next(subscription=states, state="connected")
        site.wait_until_served(root)
        assert value_of(stream) == 1.0
        assert (root.sessions, page.ask("get", "sessions"), robot.ask("get", "sessions")) == (1, 1, 1)
        assert ask(site.port, "GET", PLAIN + "/sessions").json == 1


def test_a_relayed_device_has_one_session_with_all_of_http(relayed):
    alice = basic("alice", "secret")
    stream = Stream(relayed, "/state", base=GUARDED, headers=alice)
    with Socket(relayed, GUARDED, additional_headers=alice) as page, \
            Socket(relayed, GUARDED, additional_headers=alice) as robot:
        page.open("subscribe", "state")
        robot.open("callback", "confirm")
        robot.ask("lock", "")
        assert page.refusal("set", "speed", value=1.0)[0] == "ObjectLockedError"
        robot.ask("set", "speed", value=2.0)
        assert robot.ask("get", "sessions") == 1
        assert value_of(stream) == 1.0
    assert ask(relayed, "PUT", GUARDED + "/speed", 3.0, alice).status == 204
    assert ask(relayed, "GET", GUARDED + "/speed", headers=alice).json == 3.0


def test_who_has_a_login_has_a_session_of_his_own(relayed):
    for name in ("alice", "bob"):
        assert ask(relayed, "POST", GUARDED + "/who", {}, basic(name, "secret")).json == {"result": name}
    assert ask(relayed, "GET", GUARDED + "/status").status == 401
    assert ask(relayed, "GET", GUARDED + "/status", headers=basic("alice", "no")).status == 401


def test_wrong_passwords_keep_nobody_else_out(relayed):
    """Who guesses is soon told to wait, without asking the device: of this user, and from his own address alone."""
    def status(user, password, address="127.0.0.1"):
        answer = ask(relayed, "GET", GUARDED + "/status", headers=basic(user, password), address=address)
        return answer.status, answer.json.get("detail") if answer.status == 401 else answer.json

    answers = [status("alice", f"guess {number}") for number in range(100)]
    assert {code for code, _ in answers} == {401}
    assert "too many" in answers[-1][1] and "too many" not in answers[0][1]
    assert "too many" in status("alice", "secret")[1]
    assert status("alice", "secret", "127.0.0.2") == (200, 0)
    assert status("bob", "secret") == (200, 0)


def test_a_session_that_nobody_uses_rests(node, tmp_path):
    site = Site(tmp_path, node, timeouts={"unused_session_ms": 300})
    try:
        beside = site.direct("plain")

        def is_free():
            return beside.sessions == 1

        site.gateway.wait_until(is_free)
        for _ in range(2):
            root = site.connect("plain")
            assert beside.sessions == 2
            time.sleep(0.6)
            assert root.sessions == 2, "it is used"
            assert root.state.PeekInValue()[0] == 1.0
            site.leave(root)
            site.gateway.wait_until(is_free)
        assert 'rrgate_shared_session_up{device="interop",service="plain"} 1' in ask(site.port, "GET", "/metrics").body.decode()
        site.leave(beside)
        site.device.stop()
        site.start_again()
        assert ask(site.port, "GET", PLAIN + "/status").json == 0
        assert site.connect("plain").status == 0
    finally:
        site.stop()
