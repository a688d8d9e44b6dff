"""What is open for somebody whose rights change, or whose proof is no longer good."""
import concurrent.futures
import http.client
import json
import re
import time

import issuers
import pytest

from access_gateways import cookie_of, ends, json_socket, running, sessions_of_all_kinds
from gateways import rrgate
from http_api import BASE, Stream, ask, is_alive, open_websocket
from json_sockets import Socket
from news import under_load
from users import PASSWORDS, RULES, basic, bearer, make_users


def test_a_sign_in_ends_at_once_with_what_goes_on_by_it(device, tmp_path):
    make_users(tmp_path)
    devices = [{"name": "interop", "url": device, "mode": "shared"}, {"name": "relayed", "url": device}]
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}, devices=devices) as gateway:
        gateway.wait_for("device online", device="relayed")
        page = {"Origin": f"http://127.0.0.1:{gateway.port}"}
        proof = {"user": "root", "password": PASSWORDS["root"]}
        signed = {**page, "Cookie": cookie_of(ask(gateway.port, "POST", "/api/v1/session", proof, page))}
        with sessions_of_all_kinds(gateway.port, signed) as links:
            for name in ("relay", "json", "ticket"):
                assert is_alive(links[name]), name
            assert ask(gateway.port, "DELETE", "/api/v1/session", headers=signed).status == 204
            seconds = {name: ends(link) for name, link in links.items()}
            assert max(seconds.values()) < 1.5, seconds


@pytest.mark.parametrize("how", ["deleted", "expired"])
def test_a_token_that_is_no_longer_good_ends_what_goes_on_by_it(device, tmp_path, how):
    issuer = issuers.Issuer("https://id.example", "rrgate")
    (tmp_path / "keys.json").write_text(json.dumps(issuer.key_set()))
    devices = [{"name": "interop", "url": device, "mode": "shared"}, {"name": "relayed", "url": device}]
    rrgate("token", tmp_path / "tokens", "stays", "--roles", "admin")
    token = rrgate("token", tmp_path / "tokens", "goes", "--roles", "admin")
    access = {"tokens_file": "tokens", "jwt": {"jwks_file": "keys.json"}, "rules": RULES}
    with running(tmp_path, device, access, devices=devices) as gateway:
        gateway.wait_for("device online", device="relayed")
        gateway.wait_for("session open", service="interop")
        proof = bearer(token) if how == "deleted" else bearer(issuer.token("root", ["admin"], "ES256", seconds=-26))
        with sessions_of_all_kinds(gateway.port, proof) as links:
            for name in ("relay", "json", "ticket"):
                assert is_alive(links[name]), name
            if how == "deleted":
                rrgate("token", tmp_path / "tokens", "goes", "--delete")
            seconds = {}
            for name, link in links.items():  # the first waits longest: for the file to be looked at, or the end to come
                seconds[name] = ends(link)
            assert seconds.pop("relay") < (1.5 if how == "deleted" else 6), seconds
            assert all(each < 0.5 for each in seconds.values()), seconds
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=proof).status == 401


def test_roles_that_change_hold_in_open_sessions(device, tmp_path):
    make_users(tmp_path)
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}) as gateway:
        with json_socket(gateway.port, basic("alice")) as link:
            def may_write():
                link.send(json.dumps({"id": 1, "op": "set", "path": "p_double", "value": 1.5}))
                return "result" in json.loads(link.recv(10))

            assert may_write()
            lines = (tmp_path / "users").read_text().splitlines()
            changed = [line.replace(" operator", " viewer") for line in lines]
            (tmp_path / "users.new").write_text("\n".join(changed) + "\n")
            (tmp_path / "users.new").rename(tmp_path / "users")
            gateway.wait_for("users and rights read anew")
            assert not may_write()


def test_a_command_whose_body_takes_long_needs_the_right_when_it_is_carried_out(device, tmp_path):
    make_users(tmp_path)
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}) as gateway:
        assert ask(gateway.port, "PUT", BASE + "/p_double", 1.5, basic("alice")).status == 204
        link = http.client.HTTPConnection("127.0.0.1", gateway.port, timeout=20)
        link.putrequest("PUT", BASE + "/p_double")
        for name, value in {**basic("alice"), "Content-Type": "application/json", "Content-Length": "4"}.items():
            link.putheader(name, value)
        link.endheaders(b" ")
        time.sleep(0.3)  # its head is judged meanwhile
        change_roles(tmp_path, "alice", "viewer")
        gateway.wait_for("users and rights read anew")
        link.send(b"2.5")
        assert link.getresponse().status == 403
        link.close()
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("root")).json == 1.5


def change_roles(folder, name, role):
    """As `rrgate passwd` would, without a word of the password."""
    lines = [re.sub(r"\S+$", role, line) if line.startswith(name + " ") else line
             for line in (folder / "users").read_text().splitlines()]
    (folder / "users.new").write_text("\n".join(lines) + "\n")
    (folder / "users.new").rename(folder / "users")


def test_who_may_not_everything_any_more_loses_what_passes_unread(device, tmp_path):
    make_users(tmp_path)
    rrgate("passwd", tmp_path / "users", "stays", "--roles", "admin", given="stays\n")
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}) as gateway:
        links = {name: open_websocket(gateway.port, "/devices/interop", f"Authorization: {basic(name, password)['Authorization']}\r\n")
                 for name, password in (("root", None), ("stays", "stays"))}
        assert all(is_alive(link) for link in links.values())
        change_roles(tmp_path, "root", "operator")
        gateway.wait_for("users and rights read anew")
        assert ends(links["root"]) < 1.5
        assert is_alive(links["stays"])
        for link in links.values():
            link.close()


def test_users_and_rights_are_read_anew_and_sessions_go_on(device, tmp_path):
    make_users(tmp_path)
    access = {"users_file": "users", "rules": RULES}
    with running(tmp_path, device, access) as gateway:
        link = open_websocket(gateway.port, "/devices/interop", "Authorization: " + basic("root")["Authorization"] + "\r\n")
        of_root = next(line for line in (tmp_path / "users").read_text().splitlines(True) if line.startswith("root "))

        def read():
            answer = ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera"))
            assert answer.status == 200, answer.body

        with under_load(read):
            # A new user.
            rrgate("passwd", tmp_path / "users", "carol", "--roles", "operator", given="new\n")
            gateway.wait_for("users and rights read anew")
            assert ask(gateway.port, "PUT", BASE + "/p_double", 1.5, basic("carol", "new")).status == 204
            # Other rights.
            gateway.write({**gateway.config, "access": {**access, "rules": RULES[:1] + RULES[2:]}})
            gateway.wait_for("configuration read anew")
            assert ask(gateway.port, "PUT", BASE + "/p_double", 1.5, basic("carol", "new")).status == 403
            # A file that can't be used changes nothing.
            (tmp_path / "users").write_text("broken\n")
            gateway.hang_up()
            gateway.wait_for("configuration not used; that from before stays")
            assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera")).status == 200
            # A user who is gone.
            make_users_again = tmp_path / "fresh"
            make_users_again.mkdir()
            rrgate("passwd", make_users_again / "users", "vera", "--roles", "viewer", given=PASSWORDS["vera"] + "\n")
            with open(make_users_again / "users", "a") as users:
                users.write(of_root)
            (make_users_again / "users").replace(tmp_path / "users")
            gateway.wait_for("users and rights read anew", 2)
            assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("carol", "new")).status == 401
        assert is_alive(link)
        link.close()


def test_who_loses_a_right_loses_within_a_second_what_is_open_by_it(device, tmp_path):
    make_users(tmp_path)
    access = {"users_file": "users", "rules": RULES}
    with running(tmp_path, device, access) as gateway, Socket(gateway.port, additional_headers=basic("vera")) as page, \
            Socket(gateway.port, additional_headers=basic("root")) as other:
        opened = [page.open("subscribe", "changed"), page.open("callback", "ask")]
        kept = other.open("subscribe", "changed")
        stream = Stream(gateway.port, "/changed", headers=basic("vera"), base=BASE)
        assert ask(gateway.port, "POST", BASE + "/fire", {"count": 1}, basic("root")).status == 200
        stream.next()
        gateway.write({**gateway.config, "access": {**access, "rules": [{"roles": ["viewer"], "may": ["read"]}, *RULES[1:]]}})
        gateway.wait_for("configuration read anew")
        begin = time.monotonic()
        for number in opened:
            assert "may not subscribe" in page.next(subscription=number, state="ended")["detail"]
        with pytest.raises((EOFError, OSError)):
            while True:
                stream.next()
        assert time.monotonic() - begin < 1
        assert ask(gateway.port, "POST", BASE + "/fire", {"count": 1}, basic("root")).status == 200
        other.next(subscription=kept, number=2)
        assert isinstance(page.ask("get", "p_double"), float)


def test_who_loses_a_right_loses_the_wires_and_pipes_of_a_native_client(device, tmp_path, node):
    import RobotRaconteur as RR
    make_users(tmp_path)
    access = {"users_file": "users", "rules": RULES}
    devices = [{"name": "interop", "url": device, "mode": "shared"}]
    with running(tmp_path, device, access, devices=devices) as gateway:
        gateway.wait_for("session open", service="interop")
        url = f"rr+tcp://127.0.0.1:{gateway.port}/?nodename=interop&service=interop"
        closed = {"vera": set(), "root": set()}
        roots, kept = {}, []
        for user, seen in closed.items():
            root = roots[user] = node.ConnectService(url, user, {"password": RR.VarValue(PASSWORDS[user], "string")})
            wire, pipe = root.state.Connect(), root.poses.Connect(-1)
            wire.WireConnectionClosedCallback = lambda _, seen=seen: seen.add("wire")
            pipe.PipeEndpointClosedCallback = lambda _, seen=seen: seen.add("pipe")
            kept += [wire, pipe]
        gateway.write({**gateway.config, "access": {**access, "rules": [{"roles": ["viewer"], "may": ["read"]}, *RULES[1:]]}})
        gateway.wait_for("configuration read anew")
        gateway.process.wait_until(lambda: closed["vera"] == {"wire", "pipe"})
        with pytest.raises(RR.PermissionDeniedException):
            roots["vera"].state.Connect()
        assert isinstance(roots["vera"].p_double, float)
        assert closed["root"] == set()
        for root in roots.values():
            node.DisconnectService(root)


def test_who_loses_his_rights_gets_the_answer_to_what_is_at_work(own_service, tmp_path):
    service, device = own_service
    make_users(tmp_path)
    with running(tmp_path, device, {"users_file": "users"}) as gateway:
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera")).status == 200
        service.pause()
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            try:
                waits = pool.submit(ask, gateway.port, "GET", BASE + "/p_double", headers=basic("vera"))
                time.sleep(0.3)
                others = [line for line in (tmp_path / "users").read_text().splitlines(True) if not line.startswith("vera ")]
                (tmp_path / "users").write_text("".join(others))
                gateway.hang_up()
                gateway.wait_for("users and rights read anew")
                time.sleep(1.5)  # connections are judged each second
            finally:
                service.resume()
            assert waits.result().status == 200
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera")).status == 401
