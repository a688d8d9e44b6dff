"""Who may do what in sessions that clients share, by the rights of the gateway's users. Device and clients speak Robot Raconteur."""
import contextlib
import json
import time

import numpy
import pytest
import RobotRaconteur as RR

from gateways import rrgate
from http_api import ask
from json_sockets import Socket
from leases import wait_for
from processes import free_port, start_gateway
from shared_sites import Site, start_service
from users import PASSWORDS, RULES, basic, make_users


@contextlib.contextmanager
def guarded(folder, is_up="session open", device={}, access={}, **more):
    """(gateway, its port): a shared device behind a gateway with users and rights, when the log says of its service what is
    waited for: the list of devices is not for everybody."""
    service, url = start_service(folder)
    make_users(folder)
    gateway, port = start_gateway(folder, url, device={"mode": "shared", **device},
                                  access={"users_file": "users", "rules": RULES, **access},
                                  is_up=lambda: f"{is_up} device=interop service=interop" in (folder / "gateway.log").read_text(),
                                  **more)
    try:
        yield gateway, port
    finally:
        gateway.stop()
        service.stop()


def password_of(user, password=None):
    return user, {"password": RR.VarValue(password or PASSWORDS[user], "string")}


def audited(gateway, folder, is_there):
    """What others than the audit log itself are recorded with, once it is there."""
    found = []

    def read():
        lines = map(json.loads, (folder / "audit").read_text().splitlines())
        found[:] = [line for line in lines if line["event"] not in ("started", "stopped")]
        return found and is_there(found)

    gateway.wait_until(read)
    return found


def test_rights_member_by_member(node, tmp_path):
    """Users of the gateway in a shared session, each verb against what the rules say."""
    def write_memory(root):
        root.m_numbers.Write(0, numpy.array([1.0]), 0, 1)

    attempts = {
        "read": lambda root: root.p_double,
        "write": lambda root: setattr(root, "p_double", 2.5),
        "call": lambda root: root.add(1.0, 2.0),
        "other write": lambda root: setattr(root, "p_int32", 1),
        "other call": lambda root: root.nothing(),
        "memory": write_memory,
        "peek": lambda root: root.both.PeekInValue(),
        "poke": lambda root: root.both.PokeOutValue(1.0),
        "subscribe": lambda root: root.state.Connect().Close(),
        "pipe": lambda root: root.greetings.Connect(-1).Close(),
        "below": lambda root: root.get_head().size,
        "below call": lambda root: root.get_head().identify(),
        "lock": lambda root: node.RequestObjectLock(root, RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK),
    }
    looks = {"read", "peek", "subscribe", "pipe", "below"}
    may = {"vera": looks, "alice": looks | {"write", "call"}, "root": set(attempts)}
    with guarded(tmp_path, access={"audit_file": "audit"}) as (gateway, port):
        shared_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"
        with pytest.raises(RR.AuthenticationException):
            node.ConnectService(shared_url, "alice", {"password": RR.VarValue("wrong", "string")})
        for user, allowed in may.items():
            root = node.ConnectService(shared_url, user, {"password": RR.VarValue(PASSWORDS[user], "string")})
            for what, attempt in attempts.items():
                try:
                    attempt(root)
                    denied = False
                except RR.PermissionDeniedException as error:
                    assert "may not" in str(error), str(error)
                    denied = True
                except RR.RobotRaconteurException:  # the device's own affair: it was asked
                    denied = False
                assert denied == (what not in allowed), (user, what)
            node.DisconnectService(root)
        lines = audited(gateway, tmp_path, lambda lines: any(line["event"] == "login" and line["user"] == "root" for line in lines))
        assert any(line.get("user") == "vera" and line.get("member") == "p_double" for line in lines), lines[-5:]
        logins = [(line["event"], line["user"]) for line in lines if line["event"].startswith("login")]
        assert logins == [("login_failed", "alice"), *(("login", user) for user in may)]
        assert all(line["client"].startswith("127.0.0.1:") for line in lines)


def test_a_login_that_the_device_judges_gives_no_rights_of_the_gateways_users(node, tmp_path):
    """Where the gateway has users, but none with passwords, a login is the device's; alice there is nobody here."""
    service, url = start_service(tmp_path)
    (tmp_path / "tokens").touch()
    rules = [{"roles": ["guest"], "may": ["read", "call"]}, {"roles": ["*", "operator"], "may": ["write"]}]
    access = {"tokens_file": "tokens", "anonymous_role": "guest", "rules": rules, "audit_file": "audit",
              "grants": [{"users": ["alice"], "roles": ["operator"]}]}
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, access=access)
    try:
        root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=guarded", "alice",
                                   {"password": RR.VarValue("secret", "string")})
        assert root.who() == "alice"
        with pytest.raises(RR.PermissionDeniedException, match="'alice' of the device, who is no user of the gateway, may not write"):
            root.level = 2.0
        node.DisconnectService(root)
        lines = audited(gateway, tmp_path, lambda lines: lines[-1]["event"] == "refused")
        (refused,) = (line for line in lines if line["event"] == "refused")
        assert (refused["proof"], refused["device_user"]) == ("none", "alice")
        (login,) = (line for line in lines if line["event"] == "login")
        assert (login["device_user"], login["device"], login["service"], login.get("user")) == ("alice", "interop", "guarded", None)
        assert login["client"].startswith("127.0.0.1:")
        with pytest.raises(RR.AuthenticationException):
            node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=guarded", *password_of("alice", "wrong"))
        lines = audited(gateway, tmp_path, lambda lines: lines[-1]["event"] == "login_failed")
        assert (lines[-1]["event"], lines[-1]["device_user"]) == ("login_failed", "alice")
    finally:
        gateway.stop()
        service.stop()


def test_users_that_a_reload_brings_are_the_gateways_at_services_that_are_open(node, tmp_path):
    service, url = start_service(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"})

    def connect(service, user, password):
        return node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service={service}", user,
                                   {"password": RR.VarValue(password, "string")})

    try:
        before = connect("guarded", "alice", "secret")  # a user of the device
        assert before.who() == "alice"
        make_users(tmp_path)
        config = json.loads((tmp_path / "gateway.json").read_text())
        (tmp_path / "gateway.json").write_text(json.dumps({**config, "access": {"users_file": "users", "rules": RULES}}))
        gateway.wait_until(lambda: "configuration read anew" in (tmp_path / "gateway.log").read_text())
        with pytest.raises(RR.PermissionDeniedException):
            before.who()
        for service_name in ("guarded", "interop"):
            with pytest.raises(RR.AuthenticationException):
                connect(service_name, "alice", "secret")
        root = connect("interop", "alice", PASSWORDS["alice"])
        assert root.version == "1"
        with pytest.raises(RR.PermissionDeniedException, match="operator"):
            root.nothing()
        for each in (before, root):
            node.DisconnectService(each)
    finally:
        gateway.stop()
        service.stop()


def test_who_may_do_nothing_gets_to_no_service(node, tmp_path):
    """Refused as he connects: he takes no place, is asked nothing, and is told of nothing."""
    rrgate("passwd", tmp_path / "users", "nora", "--roles", "none", given="nothing\n")
    device = {"max_clients": 1, "callbacks": [{"member": "interop.ask", "answer": "first"}]}
    strangers = []
    with guarded(tmp_path, device=device, access={"audit_file": "audit"}, node={"name": "lab.gateway"}) as (gateway, port):
        of_device, of_gateway = (f"rr+tcp://127.0.0.1:{port}/?nodename={name}&service=" for name in ("interop", "lab.gateway"))
        for where in (of_device, of_gateway):
            for name in ("interop", "guarded", "nothing"):
                with pytest.raises(RR.AuthenticationException, match=f"who is not logged in may not use service '{name}'"):
                    node.ConnectService(where + name)
                with pytest.raises(RR.AuthenticationException, match="Authentication Failed"):
                    node.ConnectService(where + name, *password_of("vera", "wrong"))
            with pytest.raises(RR.PermissionDeniedException, match="'nora' .* may not"):
                node.ConnectService(where + "interop", *password_of("nora", "nothing"))
            index = node.ConnectService(where + "RobotRaconteurServiceIndex")
            strangers.append(index)
            assert {each.Name for each in index.GetLocalNodeServices().values()} == {"RobotRaconteurServiceIndex"}
            assert index.GetRoutedNodes() == {} and index.GetDetectedNodes() == {}
        root = node.ConnectService(of_device + "interop", *password_of("root"))  # on the one seat there is
        root.ask.Function = lambda question: 2.0
        root.start_ask("may it?")
        gateway.wait_until(lambda: root.answered == 2.0)
        with pytest.raises(RR.ConnectionException, match="all the clients it may have"):
            node.ConnectService(of_gateway + "interop", *password_of("vera"))
        node.DisconnectService(root)
        audited(gateway, tmp_path, lambda lines: any((line["event"], line.get("device"), line.get("user")) == ("refused", "interop", "nora")
                                                     for line in lines))
        for each in strangers:
            node.DisconnectService(each)


def test_a_stranger_wakes_no_session_that_rests(node, tmp_path):
    """Nor does his wrong password; a login that is right does, and finds what it needs."""
    log = tmp_path / "gateway.log"
    with guarded(tmp_path, "session rests", timeouts={"unused_session_ms": 300}) as (gateway, port):
        shared_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"
        opened = log.read_text().count("session open device=interop service=interop")
        for login in ((), password_of("vera", "wrong")):
            with pytest.raises(RR.AuthenticationException):
                node.ConnectService(shared_url, *login)
        assert log.read_text().count("session open device=interop service=interop") == opened
        vera = node.ConnectService(shared_url, *password_of("vera"))
        assert vera.version == "1"
        gateway.wait_until(lambda: log.read_text().count("session open device=interop service=interop") == opened + 1)
        node.DisconnectService(vera)


def test_a_user_who_is_deleted_has_no_session_any_more(node, tmp_path):
    with guarded(tmp_path) as (_, port):
        shared_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"
        sessions = {user: node.ConnectService(shared_url, *password_of(user)) for user in ("vera", "root")}
        assert all(root.version == "1" for root in sessions.values())
        # Meanwhile: where from another client comes is for those who manage the gateway.
        wire = sessions["vera"].state.Connect()
        clients = {}
        for user in ("root", "alice"):
            answer = ask(port, "GET", "/api/v1/devices/interop/subscriptions", headers=basic(user)).json
            clients[user] = [each["client"] for each in answer["subscriptions"]]
        assert clients["alice"] == [None] and clients["root"][0].startswith("127.0.0.1:"), clients
        wire.Close()
        rrgate("passwd", tmp_path / "users", "vera", "--delete")
        began = time.monotonic()
        with pytest.raises(RR.RobotRaconteurException):
            while time.monotonic() - began < 10:
                sessions["vera"].version
        assert time.monotonic() - began < 1.5
        assert sessions["root"].version == "1"
        node.DisconnectService(sessions["root"])


def test_wrong_passwords_of_one_user_keep_out_no_other(node, tmp_path):
    with guarded(tmp_path) as (_, port):
        shared_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"
        for number in range(65):
            with pytest.raises(RR.AuthenticationException):
                node.ConnectService(shared_url, *password_of("alice", f"guess {number}"))
        root = node.ConnectService(shared_url, *password_of("root"))
        assert root.version == "1"
        node.DisconnectService(root)


def test_the_audit_log_has_the_first_packet_of_each_wire_and_pipe(node, tmp_path):
    def recorded():
        lines = [json.loads(line) for line in (tmp_path / "audit").read_text().splitlines()]
        return [(line["event"], line["user"], line["member"]) for line in lines if line.get("verb") == "write"]

    with guarded(tmp_path, access={"audit_file": "audit"}) as (gateway, port):
        root, vera = (node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop", *password_of(user))
                      for user in ("root", "vera"))
        wire, pipe, hers = root.both.Connect(), root.greetings.Connect(-1), vera.both.Connect()
        for number in range(5):
            wire.OutValue = float(number)
            pipe.SendPacket(f"hello {number}")
            hers.OutValue = -1.0
        gateway.wait_until(lambda: len(recorded()) == 3)
        gateway.wait_until(lambda: root.both.PeekOutValue()[0] == 4.0)
        assert sorted(recorded()) == [("refused", "vera", "both"), ("write", "root", "both"), ("write", "root", "greetings")]
        for each in (root, vera):
            node.DisconnectService(each)


def test_who_loses_the_right_to_lock_gives_back_what_it_has_and_may_say_so(node, tmp_path):
    """Over a JSON socket and in a native session: locks and leases end at once, and to unlock is not refused."""
    make_users(tmp_path)
    guarded = "/api/v1/devices/interop/guarded"
    everything = ["read", "subscribe", "write", "call"]

    def access(*more):
        return {"users_file": "users", "rules": [{"roles": ["operator", "viewer"], "may": [*everything, *more]}]}

    port = free_port()

    def is_up():
        with contextlib.suppress(OSError):
            return ask(port, "GET", guarded + "/speed", headers=basic("vera")).status == 200

    device = {"login": {"username": "gateway", "password": "secret"}, "leases": {"safe": [{"property": "guarded.speed", "value": 0}]}}
    site = Site(tmp_path, node, device, access=access("lock"), port=port, is_up=is_up)
    native = None
    try:
        native = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=guarded", *password_of("alice"))
        with Socket(port, guarded, additional_headers=basic("alice")) as page, \
                Socket(port, guarded, additional_headers=basic("vera")) as other:
            page.ask("lock", "tool")
            page.ask("lease", "tools/0", deadman=60000)
            tool = native.get_tools(1)
            node.RequestObjectLock(tool, RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK)
            places = ["tool/opening", "tools/0/opening", "tools/1/opening"]
            for place in places:
                assert other.refusal("set", place, value=1)[0] == "ObjectLockedError", place
            config = json.loads((tmp_path / "gateway.json").read_text())
            (tmp_path / "gateway.json").write_text(json.dumps({**config, "access": access()}))
            wait_for(lambda: "configuration read anew" in (tmp_path / "gateway.log").read_text())
            assert page.next(lease="guarded.tools[0]")["reason"] == "its holder has no right to it any more"

            def passes(place):
                return "error" not in other.next(id=other.send("set", place, value=1))
            for place in places:
                wait_for(lambda: passes(place))
            for place in places[:2]:
                name, message = page.refusal("set", place, value=2)
                assert name == "ObjectLockedError" and "unlock it" in message or "release it" in message, message
            page.ask("unlock", "tool")
            page.ask("release", "tools/0")
            node.ReleaseObjectLock(tool)
            for place in places[:2]:
                page.ask("set", place, value=2)
            tool.opening = 3.0
            assert page.refusal("lock", "tool")[0] == "PermissionDenied"
            assert page.refusal("unlock", "tool")[0] == "PermissionDenied"
            with pytest.raises(RR.PermissionDeniedException):
                node.RequestObjectLock(tool, RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK)
    finally:
        if native is not None:
            node.DisconnectService(native)
        site.stop()
