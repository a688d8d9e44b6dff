"""Leases of a shared device: who may command it, on every face, and what becomes of the device when a lease ends. Device and
native clients are those of the real package; what the device was told is asked of it by a client that comes by no gateway."""
import contextlib
import json
import signal
import subprocess
import sys
import threading
import time

import pytest
import RobotRaconteur as RR

from http_api import ask
from json_sockets import Socket
from leases import LEASES, PLAIN, REFUSED, UNANSWERED, wait_for
from news import News
from processes import free_port, start_gateway
from shared_sites import RETRY, Site, is_refused, port_of, start_arm_v2
from tap import Held, Tap
from users import PASSWORDS, basic, make_users

GATEWAY = "rr+tcp://127.0.0.1:{}/?nodename=rrgate&service=gateway"
LOCKED = RR.ObjectLockedException
DEADMAN = 200
SOON = 0.3  # s, behind the dead-man's time: when the device is safe


@pytest.fixture
def site(node, tmp_path):
    made = Site(tmp_path, node, {"leases": LEASES})
    yield made
    made.stop()


@pytest.fixture
def gateway(site):
    """The gateway's own service."""
    root = site.node.ConnectService(GATEWAY.format(site.port))
    site.roots.append(root)
    return root


def session_of(root):
    return RR.RobotRaconteurNode.s.GetServiceAttributes(root)["rrgate.session"].data


def is_safe(arm):
    return arm.speed == 0 and arm.seen_target == -1


def drives(page, arm):
    """A page that has taken a lease, and the device goes as it says."""
    page.ask("lease", deadman=DEADMAN)
    page.ask("set", "speed", value=2)
    page.ask("set", "target", value=3)
    wait_for(lambda: (arm.speed, arm.seen_target) == (2, 3))


def test_the_device_is_made_safe_when_nobody_renews(site):
    arm = site.direct("plain")
    with Socket(site.port, PLAIN) as page:
        drives(page, arm)
        for _ in range(5):
            page.ask("renew")
            time.sleep(DEADMAN / 2 / 1000)
        assert (arm.speed, arm.seen_target) == (2, 3)
        page.ask("renew")
        assert DEADMAN / 1000 - 0.02 < wait_for(lambda: is_safe(arm)) < DEADMAN / 1000 + SOON
        ended = page.next(lease="plain", state="ended")
        assert ended["reason"] == f"its holder has not renewed it for {DEADMAN} ms"
        assert page.refusal("set", "speed", value=1)[0] == "ObjectLockedError"
        assert ended["reason"] in page.refusal("renew")[1]
        assert page.refusal("set", "target", value=1)[0] == "ObjectLockedError"
        drives(page, arm)


def test_others_are_refused_on_every_face_and_may_read(site, gateway):
    arm, native = site.direct("plain"), site.connect("plain")
    target = native.target.Connect()
    with Socket(site.port, PLAIN) as other, Socket(site.port, PLAIN) as page:
        other.ask("send", "target", value=1)
        page.ask("lease", deadman=20000)
        page.ask("set", "target", value=3)
        page.ask("set", "speed", value=2)
        wait_for(lambda: arm.seen_target == 3)

        def set_speed(root):
            root.speed = 1
        with pytest.raises(LOCKED, match="another client has the lease of 'plain'"):
            set_speed(native)
        with pytest.raises(LOCKED):
            native.target.PokeOutValue(1)
        with pytest.raises(LOCKED):
            RR.RobotRaconteurNode.s.RequestObjectLock(native, RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK)
        assert is_refused(LOCKED, lambda: gateway.acquire_lease(session_of(native), "plain", 1000))
        target.OutValue = 1
        for refusal in (other.refusal("set", "speed", value=1), other.refusal("call", "move", args={"position": 1}),
                        other.refusal("send", "target", value=1), other.refusal("lease", deadman=1000)):
            assert refusal[0] == "ObjectLockedError", refusal
        for method, path, body in (("PUT", "/speed", 1), ("PUT", "/target", 1), ("POST", "/move", {"position": 1})):
            refused = ask(site.port, method, PLAIN + path, body)
            assert (refused.status, refused.json["error"]["name"]) == (423, "RobotRaconteur.ObjectLockedError"), path
        assert ask(site.port, "POST", PLAIN + "?lease=acquire&deadman=1000").status == 423

        assert (native.speed, other.ask("get", "speed"), ask(site.port, "GET", PLAIN + "/speed").json) == (2, 2, 2)
        native.finish()  # which always passes
        other.ask("call", "finish")
        assert ask(site.port, "POST", PLAIN + "/finish", {}).status == 200
        assert (arm.speed, arm.seen_target) == (2, 3)
        page.ask("release")
        wait_for(lambda: is_safe(arm))
        with pytest.raises(LOCKED, match="needs the lease of 'plain', which nobody has"):
            set_speed(native)
        native.target.PokeOutValue(5)
        wait_for(lambda: arm.seen_target == 5)


def test_a_stop_passes_where_others_are_refused_for_rates(node, tmp_path):
    site = Site(tmp_path, node, {"leases": LEASES}, rates={"client": {"per_second": 2}, "device": {"per_second": 2}}, asked_from="127.0.0.9")
    try:
        native = site.connect("plain")
        session = session_of(native)
        gateway = site.node.ConnectService(GATEWAY.format(site.port))
        site.roots.append(gateway)
        with Socket(site.port, PLAIN) as page:
            page.send("get", "speed")
            wait_for(lambda: ask(site.port, "GET", PLAIN + "/speed").status == 429)
            for _ in range(20):
                assert ask(site.port, "POST", PLAIN + "/finish", {}).status == 200
                page.ask("call", "finish")
                native.finish()
            is_slow = [page.next(id=page.send("get", "speed")).get("error", {}).get("retry_after") for _ in range(20)]
            assert is_slow.count(1) > 10
            assert any(is_refused(RR.OutOfSystemResourceException, lambda: native.speed) for _ in range(20))
            assert any(ask(site.port, "GET", PLAIN + "/finish").status == 429 for _ in range(20))  # no command
            for _ in range(20):  # nor is anybody held up who gives back what others wait for
                with pytest.raises(RR.InvalidOperationException, match="has no lease"):
                    gateway.release_lease(session, "plain")
                assert page.refusal("release")[0] == "InvalidOperation"
                page.ask("unlock")
    finally:
        site.stop()


KILLED = """
import sys, time
import RobotRaconteur as RR
node = RR.RobotRaconteurNode.s
with RR.ClientNodeSetup():
    arm = node.ConnectService(sys.argv[1])
    gateway = node.ConnectService(sys.argv[2])
    session = node.GetServiceAttributes(arm)["rrgate.session"].data
    gateway.acquire_lease(session, "plain", 20000)
    arm.speed = 2
    gateway.renew_lease(session, "plain")
    print("drives", flush=True)
    time.sleep(60)
"""


def test_a_native_client_that_is_killed_leaves_the_device_safe(site, gateway):
    arm = site.direct("plain")
    news = News()
    gateway.lease_changed += lambda lease: news.add((lease.path, lease.held, lease.reason))
    urls = [f"rr+tcp://127.0.0.1:{site.port}/?nodename={node}&service={service}"
            for node, service in (("interop", "plain"), ("rrgate", "gateway"))]
    with subprocess.Popen([sys.executable, "-c", KILLED, *urls], stdout=subprocess.PIPE) as driver:
        assert driver.stdout.readline() == b"drives\n"
        assert arm.speed == 2
        assert [(each.device, each.path, each.deadman, each.held) for each in gateway.leases] == [("interop", "plain", 20000, 1)]
        assert 0 < gateway.leases[0].left <= 20000
        driver.kill()
        assert wait_for(lambda: is_safe(arm)) < SOON
    wait_for(lambda: len(news.all()) == 2)
    assert news.all() == [("plain", 1, ""), ("plain", 0, "the connection of its holder has ended")]
    assert not gateway.leases
    assert is_refused(RR.RobotRaconteurException, lambda: gateway.acquire_lease("nobody's", "plain", 1000))


def begin_move(arm):
    threading.Thread(target=arm.move, args=(1.0,), daemon=True).start()
    wait_for(lambda: arm.moving == 1)


def test_a_socket_that_closes_leaves_the_device_safe_whatever_it_still_waits_for(site):
    arm = site.direct("plain")
    with Socket(site.port, PLAIN) as page:
        drives(page, arm)
        page.ask("lease", deadman=60000)
        page.send("call", "move", args={"position": 1})
        wait_for(lambda: arm.moving == 1)
        page.socket.close()
        assert wait_for(lambda: is_safe(arm)) < 1
        assert arm.moving == 1
    with Socket(site.port, PLAIN) as other:
        other.ask("set", "target", value=5)  # nobody has the lease
    arm.finish()


def test_a_wire_that_the_device_does_not_connect_holds_up_no_stop_behind_it(node, tmp_path):
    held = Held(b"target")
    site = Site(tmp_path, node, {"leases": LEASES}, start_arm_v2, held.line)
    try:
        arm = site.direct("plain")
        with Socket(site.port, PLAIN) as page:
            page.ask("lease", deadman=20000)
            begin_move(arm)
            held.is_on = True
            for value in (1, 2):
                page.send("send", "target", value=value)
            begin = time.monotonic()
            page.ask("call", "finish")
            page.ask("renew")
            assert time.monotonic() - begin < 1
            assert wait_for(lambda: arm.moving == 0) < 1
            wait_for(lambda: held.messages)
            assert arm.seen_target == 0
            held.is_on = False
            page.ask("get", "speed")
            wait_for(lambda: arm.seen_target == 2)
    finally:
        site.stop()


def test_no_lease_is_given_above_what_another_client_has_locked(node, tmp_path):
    leases = {"safe": [{"property": "guarded.speed", "value": 0}]}
    site = Site(tmp_path, node, {"login": {"username": "gateway", "password": "secret"}, "leases": leases})
    guarded = PLAIN.replace("plain", "guarded")
    try:
        with Socket(site.port, guarded) as one, Socket(site.port, guarded) as other:
            other.ask("lock", "tool")
            refused = one.refusal("lease", deadman=1000)
            assert refused == ("ObjectLockedError", "'guarded.tool', which is below, is locked by another client")
            one.ask("lease", "tools/1", deadman=1000)
            other.ask("unlock", "tool")
            one.ask("release", "tools/1")
            one.ask("lease", deadman=1000)
    finally:
        site.stop()


def test_requests_of_http_show_the_key_of_their_lease(site):
    arm = site.direct("plain")
    taken = ask(site.port, "POST", PLAIN + "?lease=acquire&deadman=500")
    assert taken.status == 200
    key = {"Rrgate-Lease": taken.json["lease"]}
    assert ask(site.port, "PUT", PLAIN + "/speed", 2, key).status == 204
    assert ask(site.port, "PUT", PLAIN + "/speed", 1).status == 423
    assert ask(site.port, "POST", PLAIN + "?lease=renew", headers=key).status == 204
    assert ask(site.port, "POST", PLAIN + "?lease=release", headers=key).status == 204
    wait_for(lambda: is_safe(arm))
    late = ask(site.port, "PUT", PLAIN + "/speed", 1, key)
    assert late.status == 423 and "the lease of this Rrgate-Lease has ended" in late.json["detail"]
    assert ask(site.port, "GET", PLAIN + "/speed", headers=key).status == 200
    ask(site.port, "POST", PLAIN + "?lease=acquire&deadman=200")
    wait_for(lambda: ask(site.port, "POST", PLAIN + "?lease=acquire&deadman=200").status == 200, 2)
    for query in ("lease=borrow", "lease=acquire", "lease=acquire&deadman=soon", "lease=acquire&deadman=5"):
        assert ask(site.port, "POST", f"{PLAIN}?{query}").status == 400, query


def release_by_http(port):
    taken = ask(port, "POST", PLAIN + "?lease=acquire&deadman=20000").json["lease"]
    key = {"Rrgate-Lease": taken}
    released = ask(port, "POST", PLAIN + "?lease=release", headers=key)
    assert ask(port, "PUT", PLAIN + "/speed", 1, key).status == 423  # it has ended
    return released


def test_a_release_by_http_fails_with_what_the_device_says_where_it_refuses_to_be_made_safe(node, tmp_path):
    site = Site(tmp_path, node, {"leases": REFUSED})
    try:
        refused = release_by_http(site.port)
        assert refused.status >= 400 and "none of them is meant" in refused.json["error"]["message"]
    finally:
        site.stop()


def test_a_release_by_http_says_that_the_device_has_not_answered_yet(node, tmp_path):
    site = Site(tmp_path, node, {"leases": UNANSWERED})
    try:
        arm = site.direct("plain")
        sent = release_by_http(site.port)
        assert sent.status == 202 and sent.json["sent"] == "plain" and "not known" in sent.json["unanswered"]
        arm.finish()
    finally:
        site.stop()


def test_a_device_that_was_away_is_made_safe_when_it_is_back(site):
    arm = site.direct("plain")
    with Socket(site.port, PLAIN) as page:
        page.ask("lease", deadman=20000)
        page.ask("set", "speed", value=2)
        site.line.cut()
        reason = page.next(lease="plain", state="ended")["reason"]
        assert reason == "the connection to the device was lost; the device is made safe when it is back"
        wait_for(lambda: is_safe(arm))
        site.gateway.wait_until(lambda: "the device is back, and was made safe" in site.gateway.description())
        assert page.refusal("set", "speed", value=1)[0] in ("ObjectLockedError", "ConnectionError")


def test_a_device_that_was_away_behind_another_gateway_is_made_safe_when_it_is_back(node, tmp_path):
    """The near gateway has the leases; the line that is cut is that from the far one to the device."""
    far = Site(tmp_path, node)
    (tmp_path / "near").mkdir()
    try:
        near, port = start_gateway(tmp_path / "near", f"rr+tcp://127.0.0.1:{far.port}/?nodename=interop&service=plain",
                                   device={"mode": "shared", "leases": LEASES}, retry=RETRY)
        try:
            arm = far.direct("plain")
            with Socket(port, PLAIN) as page:
                drives(page, arm)
                far.line.lead_to(free_port())
                far.line.cut()
                page.next(lease="plain", state="ended")
                far.line.lead_to(port_of(far.url))
                near.wait_until(lambda: is_safe(arm))
                near.wait_until(lambda: "was made safe" in near.description())
                assert page.refusal("set", "speed", value=1)[0] == "ObjectLockedError"
        finally:
            near.stop()
    finally:
        far.stop()


def test_leases_of_a_device_that_a_reload_brings_are_told_from_the_first_on(site, gateway):
    news = News()
    gateway.lease_changed += lambda lease: news.add((lease.device, lease.held))
    file = site.folder / "gateway.json"
    config = json.loads(file.read_text())
    config["devices"].append({**config["devices"][0], "name": "another"})
    file.write_text(json.dumps(config))
    site.gateway.process.send_signal(signal.SIGHUP)
    another = PLAIN.replace("interop", "another") + "?lease=acquire&deadman=60000"
    wait_for(lambda: ask(site.port, "POST", another).status == 200)
    news.wait_for(lambda lease: lease == ("another", 1))


def test_safe_values_that_are_lost_with_their_connection_are_sent_again(node, tmp_path):
    is_dead, swallowed = threading.Event(), bytearray()

    def pass_on(data):
        if not is_dead.is_set():
            return data
        swallowed.extend(data)
        return b""
    site = Site(tmp_path, node, {"leases": LEASES}, start_arm_v2, lambda port: Tap(port, pass_on))
    try:
        arm = site.direct("plain")
        with Socket(site.port, PLAIN) as page:
            page.ask("lease", deadman=20000)
            page.ask("set", "speed", value=2)
            page.ask("set", "target", value=3)
            wait_for(lambda: (arm.speed, arm.seen_target) == (2, 3))
            is_dead.set()
            page.ask("release")
            wait_for(lambda: b"speed" in swallowed and b"target" in swallowed)
            assert (arm.speed, arm.seen_target) == (2, 3)
            is_dead.clear()
            site.line.cut()
            wait_for(lambda: is_safe(arm))
    finally:
        site.stop()


def test_what_is_owed_to_a_device_when_the_gateway_stops_is_logged(site):
    with Socket(site.port, PLAIN) as page:
        page.ask("lease", deadman=20000)
        site.line.lead_to(free_port())
        site.line.cut()
        page.next(lease="plain", state="ended")
        site.gateway.stop()
    assert "the device was not made safe: it was away" in site.gateway.description()


def test_a_gateway_that_stops_leaves_the_device_safe(site):
    arm = site.direct("plain")
    with Socket(site.port, PLAIN) as page:
        drives(page, arm)
        page.ask("lease", deadman=60000)
        site.gateway.stop()
        assert wait_for(lambda: is_safe(arm)) < SOON


def test_an_operator_takes_a_lease_over_and_all_of_it_is_recorded(node, tmp_path):
    make_users(tmp_path)
    access = {"users_file": "users", "audit_file": "audit",
              "rules": [{"roles": ["viewer", "operator"], "may": ["read", "subscribe", "write", "call", "lock"]}]}
    auth = {name: basic(name) for name in PASSWORDS}
    port = free_port()

    def is_up():
        with contextlib.suppress(OSError):
            return ask(port, "GET", PLAIN + "/speed", headers=auth["vera"]).status == 200
    site = Site(tmp_path, node, {"leases": LEASES}, access=access, port=port, is_up=is_up)
    try:
        arm = site.direct("plain")
        arm.speed = 7
        with Socket(site.port, PLAIN, additional_headers=auth["vera"]) as vera, \
                Socket(site.port, PLAIN, additional_headers=auth["alice"]) as alice:
            vera.ask("lease", deadman=20000)
            vera.ask("set", "speed", value=2)
            assert "'vera' has the lease of 'plain'" in alice.refusal("set", "speed", value=1)[1]
            alice.ask("lease", deadman=20000, takeover=True)
            assert wait_for(lambda: is_safe(arm)) < SOON
            assert vera.next(lease="plain")["reason"] == "it was taken over by alice"
            alice.ask("set", "speed", value=3)
            assert arm.speed == 3
            assert vera.refusal("set", "speed", value=1)[0] == "ObjectLockedError"
            assert vera.refusal("lease", deadman=1000, takeover=True)[0] == "PermissionDenied"

        def ends():
            records = [json.loads(line) for line in (tmp_path / "audit").read_text().splitlines()]
            return [(each["user"], each["event"], each["outcome"]) for each in records if each["event"].startswith("lease")]
        wait_for(lambda: len(ends()) == 5)
        assert ends() == [("vera", "lease", "ok"), ("alice", "lease", "ok"), ("vera", "lease_end", "ok"),
                          ("vera", "lease", "error"), ("alice", "lease_end", "ok")]
    finally:
        site.stop()


@pytest.mark.parametrize(("safe", "why"), [
    ({"property": "plain.sped", "value": 0}, "experimental.arm.Arm has no such member"),
    ({"call": "plain.speed"}, "has a property of this name"),
    ({"call": "plain.move", "arguments": []}, "0 arguments, expected 1"),
    ({"property": "plain.speed", "value": "none"}, "speed"),
    ({"property": "plain.arms[3].speed", "value": 0}, "plain.arms[3]"),
])
def test_safe_values_that_do_not_fit_the_device_give_no_lease(node, tmp_path, safe, why):
    site = Site(tmp_path, node, {"leases": {"safe": [safe]}})
    try:
        with Socket(site.port, PLAIN) as page:
            name, text = page.refusal("lease", deadman=1000)
            assert why in text, text
            site.gateway.wait_until(lambda: why in site.gateway.description())
            page.ask("set", "speed", value=1)
    finally:
        site.stop()


def test_devices_without_leases_give_none(node, tmp_path):
    site = Site(tmp_path, node)
    try:
        with Socket(site.port, PLAIN) as page:
            assert page.refusal("lease", deadman=1000)[0] == "NotImplementedError"
            page.ask("set", "speed", value=1)
    finally:
        site.stop()


def test_a_lease_that_is_taken_and_released_stops_a_device_that_has_no_stop(node, tmp_path):
    site = Site(tmp_path, node, {"leases": {**LEASES, "takeover": ["*"]}})
    try:
        arm = site.direct("plain")
        devices = ask(site.port, "GET", "/api/v1/devices").json["devices"]
        assert [each["safe"] for each in devices if each["name"] == "interop"] == [["plain.speed", "plain.target"]]
        with Socket(site.port, PLAIN) as page:
            drives(page, arm)
            taken = ask(site.port, "POST", PLAIN + "?lease=take&deadman=2000")
            assert taken.status == 200
            key = {"Rrgate-Lease": taken.json["lease"]}
            assert ask(site.port, "POST", PLAIN + "?lease=release", headers=key).status == 204
            wait_for(lambda: is_safe(arm))
    finally:
        site.stop()
