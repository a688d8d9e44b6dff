"""Who may do what: users, tokens, certificates, proxies and rights, over HTTP, WebSockets and Robot Raconteur."""
import concurrent.futures
import contextlib
import http.client
import itertools
import json
import re
import shutil
import socket
import ssl
import subprocess
import sys
import time

import issuers
import pytest
import websockets.sync.client

from directions import PEERS
from gateways import RRGATE, Gateway, make_web_certificates, rrgate
from http_api import BASE, JSON_PROTOCOL, Stream, ask, is_alive, open_websocket, schemathesis, upgrade_status
from json_sockets import Socket
from news import under_load
from processes import Background
from users import PASSWORDS, RULES, basic, bearer, make_users


@contextlib.contextmanager
def running(folder, device, access, **more):
    gateway = Gateway(folder, {"devices": [{"name": "interop", "url": device}], "access": access, **more})
    gateway.folder = folder
    try:
        gateway.wait_for("device online", device="interop")
        yield gateway
    finally:
        assert gateway.process.stop() == 0, gateway.process.description()


@pytest.fixture(scope="module")
def guarded(device, tmp_path_factory):
    """A gateway with users, tokens, rules and an audit log."""
    folder = tmp_path_factory.mktemp("guarded")
    make_users(folder)
    token = rrgate("token", folder / "tokens", "ci", "--roles", "operator", "--days", 30)
    access = {"users_file": "users", "tokens_file": "tokens", "rules": RULES, "audit_file": "audit"}
    with running(folder, device, access) as gateway:
        gateway.token = token
        yield gateway


def audit_of(gateway, is_there=lambda records: True):
    """What others than the audit log itself are recorded with, once it is there: it is written a moment later."""
    found = []

    def read():
        lines = (gateway.folder / "audit").read_text().splitlines()
        found[:] = [each for each in map(json.loads, lines) if each["event"] not in ("started", "stopped")]
        return is_there(found)

    gateway.process.wait_until(read)
    return found


def test_everybody_sees_what_he_may(guarded):
    port = guarded.port
    for path in ("/api/v1/devices", "/api/v1/devices/interop", BASE, BASE + "/p_double", "/metrics"):
        refused = ask(port, "GET", path)
        assert refused.status == 401, path
        assert refused.headers.get_all("WWW-Authenticate") == ['Basic realm="rrgate", charset="UTF-8"', 'Bearer realm="rrgate"']
        assert refused.headers["Content-Type"] == "application/problem+json"
    for path in ("/healthz", "/readyz"):
        assert ask(port, "GET", path).status == 200, path
    devices = ask(port, "GET", "/api/v1/devices", headers=basic("vera")).json["devices"]
    assert [each["name"] for each in devices] == ["interop"]
    who = ask(port, "GET", "/api/v1/access", headers=basic("alice")).json
    assert (who["user"], who["roles"], who["proof"]) == ("alice", ["operator"], "password")
    assert ask(port, "GET", "/api/v1/access").json["user"] is None


def test_rights_of_one_member(guarded):
    """Each verb for each user, against what the rules say."""
    requests = {
        "read": ("GET", "/p_double", None), "write": ("PUT", "/p_double", 1.5), "call": ("POST", "/add", {"left": 1, "right": 2}),
        "other write": ("PUT", "/p_int32", 1), "other call": ("POST", "/nothing", {}), "memory": ("PUT", "/m_numbers?offset=3", [1]),
        "below": ("GET", "/head/name", None), "below call": ("POST", "/head/identify", None),
    }
    may = {"vera": {"read", "below"}, "alice": {"read", "write", "call", "below"}, "root": set(requests)}
    for user, (what, (method, path, body)) in itertools.product(may, requests.items()):
        answer = ask(guarded.port, method, BASE + path, body, basic(user))
        if what in may[user]:
            assert answer.status in (200, 204), (user, what, answer.body)
        else:
            assert answer.status == 403, (user, what, answer.body)
            assert answer.json["error"]["name"] == "RobotRaconteur.PermissionDenied"
            assert user in answer.json["detail"] and "may not" in answer.json["detail"]
    assert ask(guarded.port, "GET", "/metrics", headers=basic("alice")).status == 403
    assert ask(guarded.port, "GET", "/metrics", headers=basic("root")).status == 200
    documents = ask(guarded.port, "GET", "/api/v1/devices/interop/openapi.json", headers=basic("vera"))
    assert documents.status == 200 and "/p_double" in documents.body.decode()


def test_wrong_proofs(guarded):
    for headers in (basic("alice", "wonderlan"), basic("nobody", "x"), {"Authorization": "Basic !"}, bearer("rrg_" + "A" * 43),
                    bearer("a.b.c"), bearer("")):
        answer = ask(guarded.port, "GET", BASE + "/p_double", headers=headers)
        assert answer.status == 401, (headers, answer.body)
    def refused(lines):
        return {line.get("user") for line in lines if line["event"] == "login_failed"}

    assert {"alice", "nobody"} <= refused(audit_of(guarded, lambda lines: {"alice", "nobody"} <= refused(lines)))
    assert "wonderlan" not in (guarded.folder / "audit").read_text()


def test_who_guesses_passwords_has_to_wait(device, tmp_path):
    """Of one user so many guesses in a row, of one address more, then one a second; the right password too. It keeps out
    neither others of that address nor the same user elsewhere."""
    make_users(tmp_path)
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}) as gateway:
        def log_in(name, password=None, address="127.0.0.3"):
            answer = ask(gateway.port, "GET", BASE + "/p_double", headers=basic(name, password), address=address)
            return answer.status, answer.json["detail"] if answer.status != 200 else ""

        def guess(names):
            """Until that is stopped. Returns how often."""
            for guesses, name in enumerate(names):
                refused = log_in(name, f"guess {guesses}")
                if "too many logins have failed" in refused[1]:
                    return guesses
                assert refused == (401, "Invalid username or password")
            raise AssertionError("guessing goes on and on")

        assert 20 <= guess(["alice"] * 200) < 60
        assert log_in("root") == (200, "")
        assert log_in("alice", address="127.0.0.5") == (200, "")
        guess(f"user{number}" for number in range(200))
        assert log_in("vera", address="127.0.0.5") == (200, "")
        for name in ("vera 2", "vera 3"):
            rrgate("passwd", tmp_path / "users", name.replace(" ", ""), "--roles", "viewer", given="right\n")
        gateway.wait_for("users and rights read anew")
        for name in ("vera2", "vera3"):
            guess(f"user{number}" for number in range(200))
            if (answer := log_in(name, "right"))[0] != 200:  # unless the second is over just now
                break
        assert answer[0] == 401 and "too many logins have failed" in answer[1], "the right password had not to wait"
        deadline = time.monotonic() + 20
        while log_in(name, "right")[0] != 200:
            assert time.monotonic() < deadline
            time.sleep(0.1)


def test_a_right_password_gets_in_during_a_flood_of_wrong_ones(device, tmp_path):
    make_users(tmp_path)
    for number in range(3):
        rrgate("passwd", tmp_path / "users", f"user{number}", "--roles", "viewer", given="right\n")
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}) as gateway:
        numbers = itertools.count()

        def flood(address):
            def guess():
                number = next(numbers)
                name = f"user{number % 3}" if number % 2 else f"nobody{number}"
                assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic(name, f"guess {number}"), address=address).status == 401
            return guess

        with contextlib.ExitStack() as floods:
            for number in range(6):
                floods.enter_context(under_load(flood(f"127.0.1.{number + 1}")))
            for number in range(3):
                began = time.monotonic()
                answer = ask(gateway.port, "GET", BASE + "/p_double", headers=basic(f"user{number}", "right"), address="127.0.2.1")
                assert answer.status == 200, answer.body
                assert time.monotonic() - began < 10


def test_logins_that_a_device_has_not_judged_take_nobodys_place(device, own_service, tmp_path):
    service, stuck = own_service
    devices = [{"name": "interop", "url": device}, {"name": "stuck", "url": stuck, "max_clients": 1}]
    with running(tmp_path, device, {}, devices=devices) as gateway:
        gateway.wait_for("device online", device="stuck")
        service.pause()
        path = BASE.replace("devices/interop", "devices/stuck") + "/p_double"
        links = []
        try:
            for number in range(260):
                link = socket.create_connection(("127.0.0.1", gateway.port), 10, source_address=(f"127.0.1.{number % 13 + 1}", 0))
                proof = basic(f"user{number}", "guess")["Authorization"]
                link.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nAuthorization: {proof}\r\n\r\n".encode())
                links.append(link)
            assert ask(gateway.port, "GET", BASE + "/p_double").status == 200
            assert read_clients(gateway.port)["stuck"] == 0
        finally:
            for link in links:
                link.close()
            service.resume()


def read_clients(port):
    return {each["name"]: each["clients"] for each in ask(port, "GET", "/api/v1/devices").json["devices"]}


def test_api_tokens(guarded):
    answer = ask(guarded.port, "POST", BASE + "/add", {"left": 1, "right": 2}, bearer(guarded.token))
    assert answer.json == {"result": 3.0}
    assert ask(guarded.port, "POST", BASE + "/nothing", {}, bearer(guarded.token)).status == 403
    assert guarded.token not in (guarded.folder / "tokens").read_text()


def test_connections_that_pass_unread_are_for_those_who_may_everything(guarded):
    for path in ("/devices/interop", "/"):
        assert upgrade_status(guarded.port, path) == 401
        assert upgrade_status(guarded.port, path, basic("alice")) == 403
        assert upgrade_status(guarded.port, path, basic("root")) == 101
    # Native clients cannot show anything without a certificate.
    for scheme, path in (("rr+tcp", ""), ("rr+ws", ""), ("rr+ws", "devices/interop")):
        url = f"{scheme}://127.0.0.1:{guarded.port}/{path}?service=interop"
        done = subprocess.run([sys.executable, "-c", NATIVE_CLIENT, url], capture_output=True, text=True, timeout=60)
        assert done.stdout.startswith("PermissionDeniedException"), (url, done)
        assert '"mode": "shared"' in done.stdout, (url, done)
    assert '"mode": "shared"' in str(guarded.wait_for("native client refused"))
    assert '"mode": "shared"' in str(guarded.wait_for("client refused"))


def test_who_is_refused_stays_for_a_moment_at_most(device, tmp_path):
    make_users(tmp_path)
    named = {**basic("vera"), "Sec-WebSocket-Protocol": "robotraconteur.robotraconteur.com"}
    with running(tmp_path, device, {"users_file": "users", "rules": RULES}, limits={"header_timeout_ms": 500}) as gateway:
        link = open_websocket(gateway.port, "/devices/interop", "".join(f"{name}: {value}\r\n" for name, value in named.items()))
        with contextlib.closing(link):
            link.settimeout(20)
            while link.recv(4096):
                pass


NATIVE_CLIENT = """
import sys
import RobotRaconteur as RR
with RR.ClientNodeSetup():
    try:
        print(RR.RobotRaconteurNode.s.ConnectService(sys.argv[1]).p_double)
    except Exception as error:
        print(type(error).__name__, error)
"""


def test_tickets_for_pages(guarded):
    assert ask(guarded.port, "POST", "/api/v1/tickets").status == 401
    made = ask(guarded.port, "POST", "/api/v1/tickets", headers=basic("root"))
    assert made.status == 201 and made.json["expires_in"] == 30
    path = "/devices/interop?ticket=" + made.json["ticket"]
    assert upgrade_status(guarded.port, path) == 101
    assert upgrade_status(guarded.port, path) == 401  # once
    assert upgrade_status(guarded.port, "/devices/interop?ticket=" + "A" * 32) == 401
    weak = ask(guarded.port, "POST", "/api/v1/tickets", headers=basic("vera")).json["ticket"]
    assert upgrade_status(guarded.port, "/devices/interop?ticket=" + weak) == 403
    foreign = ask(guarded.port, "POST", "/api/v1/tickets", headers={**basic("root"), "Origin": "https://evil.example"})
    assert foreign.status == 403


def cookie_of(answer):
    assert answer.status == 201, answer.body
    return answer.headers["Set-Cookie"].split(";")[0]


def test_sign_ins_hold_at_all_gateways_of_one_key(device, tmp_path):
    """With TLS before them, of which a trusted proxy tells: the cookie is of that one, and for TLS alone."""
    (tmp_path / "ticket.key").write_text("of this test alone " * 3)
    access = {"users_file": "users", "ticket_key_file": str(tmp_path / "ticket.key"), "rules": RULES, "audit_file": "audit"}
    page = {"Host": "localhost", "Origin": "https://localhost", "X-Forwarded-Proto": "https"}
    with contextlib.ExitStack() as stack:
        gateways = []
        make_users(tmp_path)
        for name in ("here", "there"):  # each has a copy of the one file of users
            (tmp_path / name).mkdir()
            shutil.copy(tmp_path / "users", tmp_path / name)
            gateways.append(stack.enter_context(running(tmp_path / name, device, access, trusted_proxies=["127.0.0.1"])))
        here, there = gateways
        proof = {"user": "alice", "password": PASSWORDS["alice"]}
        made = ask(here.port, "POST", "/api/v1/session", proof, page)
        cookie = {"Cookie": cookie_of(made)}
        assert made.headers["Set-Cookie"].startswith("__Host-rrgate=") and made.headers["Set-Cookie"].endswith("; Secure")
        for gateway in gateways:
            who = ask(gateway.port, "GET", "/api/v1/access", headers={**page, **cookie}).json
            assert (who["user"], who["proof"], who["session"]) == ("alice", "password", True)
            assert ask(gateway.port, "PUT", BASE + "/p_double", 1.5, {**page, **cookie}).status == 204
            elsewhere = {**page, **cookie, "Origin": "https://localhost:8443"}
            assert ask(gateway.port, "PUT", BASE + "/p_double", 1.5, elsewhere).status == 403
        rrgate("passwd", tmp_path / "there" / "users", "alice", "--roles", "operator", given="another\n")
        there.wait_for("users and rights read anew")
        assert ask(there.port, "GET", "/api/v1/access", headers={**page, **cookie}).json["user"] is None
        assert ask(here.port, "DELETE", "/api/v1/session", headers={**page, **cookie}).status == 204
        assert ask(here.port, "GET", "/api/v1/access", headers={**page, **cookie}).json["user"] is None
        assert [line["event"] for line in audit_of(here) if line["event"].startswith("signed")] == ["signed_in", "signed_out"]


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


def test_the_audit_log_tells_who_did_what(guarded):
    ask(guarded.port, "PUT", BASE + "/p_double", 2.5, basic("alice"))
    ask(guarded.port, "PUT", BASE + "/p_int32", 2, basic("vera"))
    ask(guarded.port, "POST", BASE + "/add", {"left": 1, "right": 2}, basic("alice"))
    lines = audit_of(guarded, lambda lines: lines[-1]["event"] == "call" and "refused" in {line["event"] for line in lines[-4:]})
    wrote = next(line for line in reversed(lines) if line["event"] == "write")
    assert (wrote["user"], wrote["proof"], wrote["device"], wrote["path"], wrote["member"]) == \
        ("alice", "password", "interop", "interop", "p_double")
    refused = next(line for line in reversed(lines) if line["event"] == "refused")
    assert (refused["user"], refused["verb"], refused["member"]) == ("vera", "write", "p_int32")
    assert wrote["client"].startswith("127.0.0.1:") and wrote["time"].endswith("Z")
    assert {"login", "write", "call", "refused"} <= {line["event"] for line in lines}


def test_strangers_fill_no_disk(device, tmp_path):
    """Each of their refusals is counted; one of an address a minute is written."""
    make_users(tmp_path)
    access = {"users_file": "users", "tokens_file": "tokens", "rules": RULES, "audit_file": "audit"}
    (tmp_path / "tokens").touch(0o600)
    with running(tmp_path, device, access) as gateway:
        for number in range(50):
            proof = bearer("rrg_" + "A" * 43) if number % 2 else {}
            assert ask(gateway.port, "PUT", BASE + "/p_double", 1.5, proof).status == 401
        assert ask(gateway.port, "PUT", BASE + "/p_double", 1.5, address="127.0.0.7").status == 401
        assert ask(gateway.port, "PUT", BASE + "/p_int32", 1, basic("vera")).status == 403
        lines = audit_of(gateway, lambda lines: len(lines) >= 4)
        assert [(line["event"], line["proof"], line["client"].split(":")[0]) for line in lines] == [
            ("refused", "none", "127.0.0.1"), ("refused", "none", "127.0.0.7"), ("login", "password", "127.0.0.1"),
            ("refused", "password", "127.0.0.1")]
    (summed,) = (line for line in map(json.loads, (tmp_path / "audit").read_text().splitlines()) if line["event"] == "refusals")
    assert (summed["client"], summed["detail"]) == ("127.0.0.1", "49 more within a minute")


def test_a_new_audit_file_after_a_hang_up(guarded):
    (guarded.folder / "audit").rename(guarded.folder / "audit.1")
    ask(guarded.port, "PUT", BASE + "/p_double", 3.5, basic("alice"))
    guarded.hang_up()
    guarded.process.wait_until(lambda: (guarded.folder / "audit").exists())
    ask(guarded.port, "PUT", BASE + "/p_double", 4.5, basic("alice"))
    assert audit_of(guarded, lambda records: records and records[-1]["event"] == "write")


def test_a_full_disk_costs_lines_of_the_audit_log_alone(device, tmp_path):
    make_users(tmp_path)
    with running(tmp_path, device, {"users_file": "users", "audit_file": "/dev/full"}) as gateway:
        for _ in range(3):
            assert ask(gateway.port, "PUT", BASE + "/p_double", 1.5, basic("alice")).status == 204
        gateway.wait_for("audit log can't be written")
        assert len(gateway.events("audit log can't be written")) == 1


def test_a_client_asks_and_an_admin_decides(guarded):
    requests = "/api/v1/access/requests"
    asked = ask(guarded.port, "POST", requests, {"name": "tablet", "reason": "cell 3"})
    assert asked.status == 202, asked.body
    one, secret = asked.json["id"], asked.json["secret"]
    claim = lambda: ask(guarded.port, "POST", f"{requests}/{one}/claim", {"secret": secret})
    assert claim().json == {"state": "pending"}
    assert ask(guarded.port, "GET", requests).status == 401
    assert ask(guarded.port, "GET", requests, headers=basic("alice")).status == 403
    assert ask(guarded.port, "POST", f"{requests}/{one}/approve", {}, basic("alice")).status == 403
    (listed,) = ask(guarded.port, "GET", requests, headers=basic("root")).json["requests"]
    assert (listed["name"], listed["reason"], listed["state"]) == ("tablet", "cell 3", "pending")
    assert secret not in json.dumps(listed)
    assert ask(guarded.port, "POST", f"{requests}/{one}/claim", {"secret": "x"}).status == 404
    approved = ask(guarded.port, "POST", f"{requests}/{one}/approve", {"roles": ["viewer"], "days": 7}, basic("root"))
    assert approved.json == {"state": "approved"}
    token = claim().json["token"]
    assert claim().status == 404  # once
    assert ask(guarded.port, "GET", BASE + "/p_double", headers=bearer(token)).status == 200
    assert ask(guarded.port, "PUT", BASE + "/p_double", 1, bearer(token)).status == 403
    refused = ask(guarded.port, "POST", requests, {"name": "other"}).json
    assert ask(guarded.port, "POST", f"{requests}/{refused['id']}/deny", {}, basic("root")).json == {"state": "denied"}
    again = ask(guarded.port, "POST", f"{requests}/{refused['id']}/claim", {"secret": refused["secret"]})
    assert again.json == {"state": "denied"}
    for wrong in ({"name": ""}, {"name": "a b"}, {"name": 7}, {"name": "a", "reason": "x" * 600}):
        assert ask(guarded.port, "POST", requests, wrong).status == 400
    statuses = [ask(guarded.port, "POST", requests, {"name": f"n{i}"}).status for i in range(4)]
    assert statuses == [202, 202, 202, 429]


def test_a_token_gets_nothing_by_the_name_that_its_client_has_chosen(device, tmp_path):
    make_users(tmp_path)
    (tmp_path / "tokens").touch(0o600)
    access = {"users_file": "users", "tokens_file": "tokens", "rules": RULES, "audit_file": "audit",
              "grants": [{"users": ["vera"], "roles": ["operator"]}]}
    with running(tmp_path, device, access) as gateway:
        requests = "/api/v1/access/requests"
        asked = ask(gateway.port, "POST", requests, {"name": "vera"}).json
        decided = ask(gateway.port, "POST", f"{requests}/{asked['id']}/approve", {"roles": ["viewer"], "days": 7}, basic("root"))
        assert decided.status == 200, decided.body
        token = ask(gateway.port, "POST", f"{requests}/{asked['id']}/claim", {"secret": asked["secret"]}).json["token"]
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=bearer(token)).status == 200
        assert ask(gateway.port, "PUT", BASE + "/p_double", 1, bearer(token)).status == 403
        assert ask(gateway.port, "PUT", BASE + "/p_double", 1, basic("vera")).status == 204
        (approved,) = (line for line in audit_of(gateway, lambda lines: lines[-1]["event"] == "write") if line["event"] == "approved")
        assert approved["user"] == "root" and "roles viewer, until 2" in approved["detail"]


def test_the_gateways_document_is_kept_with_users_and_rights(device, tmp_path):
    """What nobody, one who may look and an admin are answered is what the document says."""
    make_users(tmp_path)
    (tmp_path / "tokens").touch(0o600)
    access = {"users_file": "users", "tokens_file": "tokens", "rules": RULES}
    with running(tmp_path, device, access) as gateway:
        for user in ("root", "vera", None):  # who may decide comes first: what others ask for stays open
            more = ["--auth", f"{user}:{PASSWORDS[user]}"] if user else []
            assert " selected" in schemathesis(tmp_path, gateway.port, "/api/v1/openapi.json", *more)
        document = ask(gateway.port, "GET", "/api/v1/openapi.json").json
        assert document["tags"] == [] and "examples" not in document["components"]["parameters"]["device"]
        known = ask(gateway.port, "GET", "/api/v1/openapi.json", headers=basic("vera")).json
        assert [tag["name"] for tag in known["tags"]] == ["interop"]
        assert (tmp_path / "tokens").read_text()  # the admin's run has approved requests


def test_json_web_tokens(device, tmp_path):
    issuer = issuers.Issuer("https://id.example", "rrgate")
    (tmp_path / "keys.json").write_text(json.dumps(issuer.key_set()))
    access = {"jwt": {"jwks_file": "keys.json", "issuer": "https://id.example", "audience": "rrgate"}, "rules": RULES}
    with running(tmp_path, device, access) as gateway:
        for algorithm in issuers.ALGORITHMS:
            good = issuer.token("alice", ["viewer"], algorithm)
            assert ask(gateway.port, "GET", BASE + "/p_double", headers=bearer(good)).status == 200, algorithm
            assert ask(gateway.port, "PUT", BASE + "/p_double", 1, bearer(good)).status == 403
            late = issuer.token("alice", ["viewer"], algorithm, seconds=-60)
            refused = ask(gateway.port, "GET", BASE + "/p_double", headers=bearer(late))
            assert refused.status == 401 and "expired" in refused.json["detail"]
        for forged in (issuer.unsigned("alice", ["admin"]), issuer.signed_with_public_key("alice", ["admin"])):
            assert ask(gateway.port, "GET", BASE + "/p_double", headers=bearer(forged)).status == 401


@contextlib.contextmanager
def publishing(folder, device, tls_of=None, **served):
    """(server, gateway): an issuer's server, and a gateway that takes its keys from there."""
    make_web_certificates(folder / "id")
    make_web_certificates(folder / "other")
    server = issuers.IssuerServer(folder / "id" / "localhost.pem", folder / "id" / "localhost.key")
    for name, value in served.items():
        setattr(server, name, value)
    jwt = {"discover": True, "issuer": server.url, "audience": "rrgate", "ca": [str(folder / (tls_of or "id") / "web-ca.pem")]}
    token = rrgate("token", folder / "tokens", "ci", "--roles", "admin")
    try:
        with running(folder, device, {"jwt": jwt, "tokens_file": "tokens", "rules": RULES}) as gateway:
            gateway.token = token
            yield server, gateway
    finally:
        server.stop()


def test_keys_that_the_issuer_publishes(device, tmp_path):
    """A token that names a new one has them fetched again; whoever makes names up has not."""
    first = issuers.Issuer("", "rrgate")
    with publishing(tmp_path, device, key_set=first.key_set()) as (server, gateway):
        first.name = server.url

        def status(issuer, algorithm="ES256"):
            return ask(gateway.port, "GET", BASE + "/p_double", headers=bearer(issuer.token("alice", ["viewer"], algorithm))).status

        gateway.wait_for("keys of the issuer fetched")
        assert [status(first, algorithm) for algorithm in issuers.ALGORITHMS] == [200, 200, 200]
        link = open_websocket(gateway.port, "/devices/interop",
                              f"Authorization: {bearer(first.token('root', ['admin'], 'ES256'))['Authorization']}\r\n")
        assert is_alive(link)
        assert server.asked["/keys"] == 1
        second, third = (issuers.Issuer(server.url, "rrgate", generation) for generation in ("-2", "-3"))
        server.key_set = second.key_set()
        assert [status(second), status(second, "EdDSA"), status(first)] == [200, 200, 401]
        assert ends(link) < 2  # its key was taken back
        assert server.asked["/keys"] == 2
        server.key_set = third.key_set()
        assert [status(third) for _ in range(20)] == [401] * 20  # the issuer has just been asked
        assert server.asked["/keys"] == 2
        for forged in (second.unsigned("alice", ["admin"]), second.signed_with_public_key("alice", ["admin"])):
            assert ask(gateway.port, "GET", BASE + "/p_double", headers=bearer(forged)).status == 401
        server.stop()
        assert status(second) == 200


def test_an_issuer_that_does_not_answer_keeps_nobody_else_waiting(device, tmp_path):
    with publishing(tmp_path, device, silent=True) as (server, gateway):
        waits = bearer(issuers.Issuer(server.url, "rrgate").token("alice", ["viewer"], "ES256"))
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            waiting = pool.submit(ask, gateway.port, "GET", BASE + "/p_double", None, waits)
            began = time.monotonic()
            for _ in range(20):
                assert ask(gateway.port, "GET", BASE + "/p_double", headers=bearer(gateway.token)).status == 200
            assert time.monotonic() - began < 2 and not waiting.done()
            assert waiting.result(20).status == 401
        ask(gateway.port, "GET", BASE + "/p_double", headers=waits)
        began = time.monotonic()
        assert gateway.process.stop() == 0
        assert time.monotonic() - began < 4


@pytest.mark.parametrize("wrong, why", [({"tls_of": "other"}, "certificate"), ({"name": "https://evil.example"}, "evil.example"),
                                        ({"key_set": {"keys": [{"kty": "oct", "k": "A" * 43}]}}, "secret")])
def test_an_issuer_that_is_not_believed(device, tmp_path, wrong, why):
    """Another CA than the configured one; a document of another issuer; a secret that everybody may read."""
    with publishing(tmp_path, device, **wrong) as (server, gateway):
        failed = gateway.wait_for("keys of the issuer can't be fetched; those from before stay in use")
        assert why in failed["error"]
        token = issuers.Issuer(server.url, "rrgate").token("alice", ["viewer"], "ES256")
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=bearer(token)).status == 401


def test_client_certificates(device, tmp_path):
    tls = make_web_certificates(tmp_path / "web")
    people = issuers.People(tmp_path)
    access = {"client_ca": [str(people.ca)], "rules": RULES, "grants": [{"users": ["alice"], "roles": ["admin"]},
                                                                        {"users": ["v*"], "roles": ["viewer"]}]}
    with running(tmp_path, device, access, tls=tls) as gateway:
        def status(name, method="GET", path=BASE + "/p_double", body=None):
            context = ssl.create_default_context(cafile=tmp_path / "web" / "web-ca.pem")
            if name:
                context.load_cert_chain(*people.certificate(name))
            return ask(gateway.port, method, path, body, context=context).status

        assert status("alice") == 200 and status("alice", "PUT", body=1.5) == 204
        assert status("vera") == 200 and status("vera", "PUT", body=1.5) == 403
        assert status("stranger") == 403
        assert status(None) == 403  # there is nothing to ask for but a certificate
        mallory = issuers.People(tmp_path / "mallory")
        context = ssl.create_default_context(cafile=tmp_path / "web" / "web-ca.pem")
        context.load_cert_chain(*mallory.certificate("alice"))
        with pytest.raises((ssl.SSLError, ConnectionError)):
            ask(gateway.port, "GET", BASE + "/p_double", context=context)


def test_a_certificate_that_expires_ends_what_goes_on_by_it(device, tmp_path):
    tls = make_web_certificates(tmp_path / "web")
    people = issuers.People(tmp_path)
    access = {"client_ca": [str(people.ca)]}
    with running(tmp_path, device, access, tls=tls) as gateway:
        def connection(certificate):
            context = ssl.create_default_context(cafile=tmp_path / "web" / "web-ca.pem")
            context.load_cert_chain(*certificate)
            return http.client.HTTPSConnection("127.0.0.1", gateway.port, timeout=20, context=context)

        lasting = Stream(gateway.port, BASE + "/cleared", connection=connection(people.certificate("vera")))
        kept = connection(brief := people.certificate("alice", seconds=4))
        kept.request("GET", BASE + "/p_double")
        assert kept.getresponse().read() and kept.sock
        stream = Stream(gateway.port, BASE + "/cleared", connection=connection(brief))
        assert ends(stream.connection.sock or stream.response.fp.raw._sock) < 6
        kept.request("GET", BASE + "/p_double")
        assert kept.getresponse().status in (401, 403)
        assert len(gateway.events("client ended: what it has shown was revoked or has expired")) == 1  # the other goes on
        stream.close()
        lasting.close()
        kept.close()


def test_certificates_that_are_revoked(device, tmp_path):
    tls = make_web_certificates(tmp_path / "web")
    people = issuers.People(tmp_path)
    alice, vera = people.certificate("alice"), people.certificate("vera")
    access = {"client_ca": [str(people.ca)], "client_crl": [str(people.revoke())]}
    with running(tmp_path, device, access, tls=tls) as gateway:
        def status(certificate):
            context = ssl.create_default_context(cafile=tmp_path / "web" / "web-ca.pem")
            context.load_cert_chain(*certificate)
            return ask(gateway.port, "GET", BASE + "/p_double", context=context).status

        assert status(alice) == status(vera) == 200
        people.revoke(alice[0])
        gateway.wait_for("TLS files read anew")
        gateway.wait_for("users and rights read anew")
        with pytest.raises((ssl.SSLError, ConnectionError)):
            status(alice)
        assert status(vera) == 200
        (tmp_path / "crl.pem").write_text("nothing")  # changes nothing
        assert "found none in it" in gateway.wait_for("TLS files can't be used; those from before stay in use")["error"]
        assert status(vera) == 200


def test_a_certificate_that_is_revoked_ends_what_goes_on_by_it(device, tmp_path):
    """Event streams, WebSockets, requests on a connection that was there before, and tickets that it was given."""
    tls = make_web_certificates(tmp_path / "web")
    people = issuers.People(tmp_path)
    access = {"client_ca": [str(people.ca)], "client_crl": [str(people.revoke())], "grants": [{"users": ["*"], "roles": ["viewer"]}]}
    with running(tmp_path, device, access, tls=tls) as gateway:
        def connection(certificate):
            context = ssl.create_default_context(cafile=tmp_path / "web" / "web-ca.pem")
            context.load_cert_chain(*certificate)
            return http.client.HTTPSConnection("127.0.0.1", gateway.port, timeout=20, context=context)

        def status(kept, method="GET", path=BASE + "/p_double"):
            kept.request(method, path, headers={"Content-Length": "0"} if method == "POST" else {})
            answer = kept.getresponse()
            return answer.status, answer.read()

        alice, vera = (people.certificate(name) for name in ("alice", "vera"))
        kept, others = connection(alice), connection(vera)
        assert status(kept)[0] == status(others)[0] == 200
        ticket = json.loads(status(kept, "POST", "/api/v1/tickets")[1])["ticket"]
        lasting = Stream(gateway.port, BASE + "/cleared", connection=connection(vera))
        stream = Stream(gateway.port, BASE + "/cleared", connection=connection(alice))
        page = connection(alice)
        page.request("GET", BASE, headers={"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13",
                                           "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
                                           "Sec-WebSocket-Protocol": "rrgate.json.v1"})
        link = page.sock
        assert page.getresponse().status == 101
        begin = time.monotonic()
        people.revoke(alice[0])
        for open_one in (stream.connection.sock or stream.response.fp.raw._sock, link):
            ends(open_one)
        assert time.monotonic() - begin < 2  # a second, and what a busy machine adds
        assert status(kept)[0] in (401, 403)
        assert upgrade_status(gateway.port, BASE + "?ticket=" + ticket, {"Sec-WebSocket-Protocol": "rrgate.json.v1"}) in (401, 403)
        assert status(others)[0] == 200
        assert len(gateway.events("client ended: what it has shown was revoked or has expired")) == 2
        for each in (stream, lasting, kept, others, page):
            each.close()


def test_a_ca_that_is_revoked_ends_what_goes_on_by_its_certificates(device, tmp_path):
    tls = make_web_certificates(tmp_path / "web")
    people = issuers.People(tmp_path)
    room = issuers.People(tmp_path / "room", "People of the room", above=people)
    access = {"client_ca": [str(people.ca)], "client_crl": [str(people.revoke()), str(room.revoke())]}
    with running(tmp_path, device, access, tls=tls) as gateway:
        def stream(certificate):
            context = ssl.create_default_context(cafile=tmp_path / "web" / "web-ca.pem")
            context.load_cert_chain(*certificate)
            connection = http.client.HTTPSConnection("127.0.0.1", gateway.port, timeout=20, context=context)
            return Stream(gateway.port, BASE + "/cleared", connection=connection)

        lasting, ended = stream(people.certificate("vera")), stream(room.certificate("alice"))
        people.revoke(room.ca)
        ends(ended.connection.sock or ended.response.fp.raw._sock)
        assert len(gateway.events("client ended: what it has shown was revoked or has expired")) == 1
        ended.close()
        lasting.close()


def test_a_grant_that_is_taken_back_is_gone_for_certificates_too(device, tmp_path):
    """On a connection that was there before."""
    tls = make_web_certificates(tmp_path / "web")
    people = issuers.People(tmp_path)
    access = {"client_ca": [str(people.ca)], "rules": RULES, "grants": [{"users": ["alice"], "roles": ["operator"]}]}
    with running(tmp_path, device, access, tls=tls) as gateway:
        context = ssl.create_default_context(cafile=tmp_path / "web" / "web-ca.pem")
        context.load_cert_chain(*people.certificate("alice"))
        kept = http.client.HTTPSConnection("127.0.0.1", gateway.port, timeout=20, context=context)

        def status():
            kept.request("GET", BASE + "/p_double")
            answer = kept.getresponse()
            answer.read()
            return answer.status

        assert status() == 200
        link = kept.sock
        gateway.write({**gateway.config, "access": {**access, "grants": []}})
        gateway.wait_for("configuration read anew")
        assert status() == 403 and kept.sock is link
        kept.close()


def test_tls_alone(device, tmp_path):
    """What comes in clear is sent to HTTPS where nothing was shown, and refused where something was: it is not even looked at."""
    make_users(tmp_path)
    tls = {**make_web_certificates(tmp_path / "web"), "required": True}
    devices = [{"name": "interop", "url": device}, {"name": "shared", "url": device, "mode": "shared"}]
    access = {"users_file": "users", "rules": RULES, "audit_file": "audit"}
    with running(tmp_path, device, access, tls=tls, devices=devices, trusted_proxies=["127.0.0.2"]) as gateway:
        context = ssl.create_default_context(cafile=tmp_path / "web" / "web-ca.pem")
        assert ask(gateway.port, "GET", "/healthz").status == ask(gateway.port, "GET", "/readyz").status == 200
        for path in ("/", "/api/v1/devices?x=1", "/metrics"):
            sent = ask(gateway.port, "GET", path)
            assert (sent.status, sent.headers["Location"]) == (308, f"https://127.0.0.1:{gateway.port}{path}")
        for method, path, headers in (("GET", BASE + "/p_double", basic("root")), ("GET", "/", bearer("rrg_x")),
                                      ("GET", "/api/v1/devices?ticket=x", {}), ("PUT", BASE + "/p_double", {})):
            refused = ask(gateway.port, method, path, headers=headers)
            assert refused.status == 403 and "TLS alone" in refused.json["detail"], path
            assert ("known to others" in refused.json["detail"]) == (method == "GET")
        for path in ("/devices/interop", "/devices/shared", "/"):
            assert upgrade_status(gateway.port, path, basic("root")) == 403
        assert audit_of(gateway) == []
        for name in ("interop", "shared"):
            url = f"rr+tcp://127.0.0.1:{gateway.port}/?{'nodename=shared&' if name == 'shared' else ''}service=interop"
            done = subprocess.run([sys.executable, "-c", NATIVE_CLIENT, url], capture_output=True, text=True, timeout=60)
            assert done.stdout.startswith("PermissionDeniedException") and "TLS alone" in done.stdout, (url, done)
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("root"), context=context).status == 200
        through = ask(gateway.port, "GET", BASE + "/p_double", headers={**basic("root"), "X-Forwarded-Proto": "https"}, address="127.0.0.2")
        assert through.status == 200
        for scheme, status in (("https", 200), ("http", 403)):
            origin = {"Origin": f"{scheme}://localhost:{gateway.port}", **basic("root")}
            assert ask(gateway.port, "GET", BASE + "/p_double", headers=origin, context=context).status == status


def test_check_config_warns_of_what_may_not_be_meant(tmp_path):
    make_users(tmp_path)
    issuer = issuers.Issuer("https://id.example", "rrgate")
    (tmp_path / "keys.json").write_text(json.dumps(issuer.key_set()))
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({
        "listen": ["127.0.0.1:0"], "devices": [{"name": "arm", "url": "rrs+tcp://127.0.0.1:1/?nodename=arm"}],
        "trusted_proxies": ["127.0.0.1"], "tls": make_web_certificates(tmp_path / "web"),
        "access": {"users_file": "users", "jwt": {"jwks_file": "keys.json"}}}))
    done = subprocess.run([RRGATE, "check-config", config], capture_output=True, text=True, timeout=30)
    assert done.returncode == 0 and "good; 1 devices" in done.stdout
    warned = [line.split(": ")[1:3] for line in done.stderr.splitlines()]
    assert warned == [["/access/jwt/issuer", "warning"], ["/access/jwt/audience", "warning"], ["/devices/0/url", "warning"],
                      ["/access/rules", "warning"], ["/tls/required", "warning"]]


def test_what_a_trusted_proxy_says(device, tmp_path):
    access = {"identity_headers": {"user": "X-User", "roles": "X-Roles"}, "rules": RULES}
    says = {"X-User": "alice", "X-Roles": "viewer, operator"}
    with running(tmp_path, device, access, trusted_proxies=["127.0.0.2"]) as gateway:
        def status(source, headers):
            made = http.client.HTTPConnection("127.0.0.1", gateway.port, timeout=20, source_address=(source, 0))
            made.request("PUT", BASE + "/p_double", "1.5", {"Content-Type": "application/json", **headers})
            with contextlib.closing(made):
                return made.getresponse().status

        assert status("127.0.0.2", says) == 204
        assert status("127.0.0.2", {**says, "X-Roles": "viewer"}) == 403
        assert status("127.0.0.1", says) == 403
        assert status("127.0.0.2", {}) == 403
        # A proxy that adds its header behind the client's: nobody knows which is whose.
        for name, theirs in says.items():
            made = http.client.HTTPConnection("127.0.0.1", gateway.port, timeout=20, source_address=("127.0.0.2", 0))
            made.putrequest("GET", BASE + "/p_double")
            for header, value in [(name, "mallory"), *says.items()]:
                made.putheader(header, value)
            made.endheaders()
            with contextlib.closing(made):
                answer = made.getresponse()
                assert answer.status == 400 and f"header '{name}' came 2 times" in json.loads(answer.read())["detail"]


def ends(link):
    """Waits for the end of a connection, however it comes. Returns after how many seconds."""
    began = time.monotonic()
    link.settimeout(10)
    with contextlib.suppress(ConnectionError):
        while link.recv(4096):
            pass
    return time.monotonic() - began


@contextlib.contextmanager
def sessions_of_all_kinds(port, proof, protocol="Sec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\n"):
    """{name: socket} of what stays open for somebody: relayed, shared and JSON sessions, streams; and one that is let in
    by a ticket for the same proof."""
    header = "".join(f"{name}: {value}\r\n" for name, value in proof.items())
    ticket = ask(port, "POST", "/api/v1/tickets", headers=proof).json["ticket"]
    links = {
        "relay": open_websocket(port, "/devices/relayed", header),
        "shared": open_websocket(port, "/devices/interop", header + protocol),
        "json": open_websocket(port, BASE, header + f"Sec-WebSocket-Protocol: {JSON_PROTOCOL}\r\n"),
        "ticket": open_websocket(port, f"/devices/interop?ticket={ticket}", protocol),
    }
    stream = Stream(port, BASE + "/cleared", proof)
    links["stream"] = stream.connection.sock or stream.response.fp.raw._sock
    try:
        yield links
    finally:
        stream.close()
        for link in links.values():
            link.close()


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


def test_strangers_find_no_node_by_its_name(guarded):
    """A node that is there refuses them in the same words as one that is not."""
    named = {"Sec-WebSocket-Protocol": "robotraconteur.robotraconteur.com"}
    page = {"Origin": f"http://127.0.0.1:{guarded.port}"}
    there = ask(guarded.port, "GET", "/api/v1/devices/interop", headers=basic("root")).json
    asked = {"nodename": (there["node_name"], "nobody.there"), "nodeid": (there["node_id"], "12345678-1234-4321-8765-123456789abc")}
    for part, values in asked.items():
        for headers in ({}, named, page, {**page, **named}):
            statuses = {upgrade_status(guarded.port, f"/?{part}={value}&service=interop", headers) for value in values}
            assert len(statuses) == 1 and statuses <= {101, 401}, (part, headers, statuses)
        for scheme in ("rr+tcp", "rr+ws"):
            answers = set()
            for value in values:
                url = f"{scheme}://127.0.0.1:{guarded.port}/?{part}={value}&service=interop"
                done = subprocess.run([sys.executable, "-c", NATIVE_CLIENT, url], capture_output=True, text=True, timeout=60)
                answers.add(done.stdout)
            assert len(answers) == 1 and answers.pop().startswith("PermissionDeniedException"), (part, scheme, done)
    for headers in ({}, named, page):
        statuses = {upgrade_status(guarded.port, f"/devices/{name}", headers) for name in ("interop", "nothing")}
        assert len(statuses) == 1, (headers, statuses)
    # Who may see devices is told.
    assert upgrade_status(guarded.port, "/?nodename=nobody.there&service=interop", basic("vera")) == 404


def test_strangers_are_not_told_what_there_is(guarded):
    """What is there is refused to them in the same words as what is not; who may see it hears 404."""
    for pattern in ("/devices/{}", "/api/v1/devices/{}", "/api/v1/devices/{}/thing/speed", "/api/v1/devices/{}/openapi.json"):
        answers = [ask(guarded.port, "GET", pattern.format(name)) for name in ("interop", "nothing")]
        assert [answer.status for answer in answers] == [401, 401], pattern
        there, missing = (answer.json["detail"].replace(name, "X") for answer, name in zip(answers, ("interop", "nothing")))
        assert there == missing
        assert ask(guarded.port, "GET", pattern.format("nothing"), headers=basic("root")).status == 404
    for path in ("/devices/{}", "/api/v1/devices/{}/interop"):
        for name in ("interop", "nothing"):
            protocol = {"Sec-WebSocket-Protocol": JSON_PROTOCOL} if "api" in path else {}
            assert upgrade_status(guarded.port, path.format(name), protocol) == 401, (path, name)


def test_an_anonymous_role(device, tmp_path):
    make_users(tmp_path)
    rules = [*RULES, {"roles": ["guest"], "members": ["p_double"], "may": ["read"]}]
    with running(tmp_path, device, {"users_file": "users", "anonymous_role": "guest", "rules": rules}) as gateway:
        assert ask(gateway.port, "GET", BASE + "/p_double").status == 200
        assert ask(gateway.port, "GET", BASE + "/p_int32").status == 401
        assert ask(gateway.port, "GET", BASE + "/p_int32", headers=basic("vera")).status == 200


def test_rates(device, tmp_path):
    make_users(tmp_path)
    rates = {"user": {"per_second": 5}, "device": {"at_once": 2}}
    with running(tmp_path, device, {"users_file": "users"}, rates=rates) as gateway:
        answers = [ask(gateway.port, "GET", BASE + "/p_double", headers=basic("alice")) for _ in range(40)]
        statuses = {answer.status for answer in answers}
        assert statuses == {200, 429}
        assert next(answer for answer in answers if answer.status == 429).headers["Retry-After"] == "1"
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera")).status == 200
        streams = []
        for _ in range(2):
            stream = http.client.HTTPConnection("127.0.0.1", gateway.port, timeout=20)
            stream.request("GET", BASE + "/cleared", headers={"Accept": "text/event-stream", **basic("root")})
            response = stream.getresponse()
            assert response.status == 200
            streams.append((stream, response))
        third = ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera"))
        assert third.status == 429 and "device" in third.json["detail"]
        for stream, response in streams:
            response.close()
            stream.close()
        deadline = time.monotonic() + 10
        while ask(gateway.port, "GET", BASE + "/p_double", headers=basic("vera")).status == 429:
            assert time.monotonic() < deadline
            time.sleep(0.3)


SESSION_CLIENT = """
import sys
import RobotRaconteur as RR
with RR.ClientNodeSetup():
    root = RR.RobotRaconteurNode.s.ConnectService(sys.argv[1])
    wire = root.both.Connect()
    outcomes = []
    for _ in range(int(sys.argv[2])):
        wire.OutValue = 1.0
        try:
            outcomes.append(type(root.p_double).__name__)
        except RR.RobotRaconteurException as error:
            outcomes.append(type(error).__name__ + ": " + str(error))
    print("\\n".join(outcomes))
"""


def test_rates_of_requests_in_a_shared_session(device, tmp_path):
    devices = [{"name": "interop", "url": device, "mode": "shared"}]
    with running(tmp_path, device, {}, devices=devices, rates={"client": {"per_second": 5}}) as gateway:
        url = f"rr+tcp://127.0.0.1:{gateway.port}/?nodename=interop&service=interop"
        done = subprocess.run([sys.executable, "-c", SESSION_CLIENT, url, "60"], capture_output=True, text=True, timeout=60)
        outcomes = done.stdout.splitlines()
        assert len(outcomes) == 60 and outcomes[0] == "float", done
        refused = {each for each in outcomes if each != "float"}
        (why,) = refused
        assert why.startswith("OutOfSystemResourceException") and "asked for more than 5 requests a second from 127.0.0.1" in why
        time.sleep(1)  # or the next look would be one too many
        metrics = ask(gateway.port, "GET", "/metrics").body.decode()
        count = next(float(line.split()[1]) for line in metrics.splitlines()
                     if line.startswith("rrgate_rejected_total") and 'reason="rate"' in line)
        assert count >= len([each for each in outcomes if each != "float"])


@pytest.fixture
def own_service(tmp_path):
    """A service that no other test uses, so that it can be paused: (process, URL)"""
    process = Background([sys.executable, PEERS / "service.py"], tmp_path / "service.log")
    yield process, json.loads(process.next_line())["url"]
    process.stop()


def test_rates_of_requests_over_json_on_a_websocket(own_service, tmp_path):
    make_users(tmp_path)
    service, device = own_service
    rates = {"user": {"per_second": 5}, "device": {"at_once": 2}}
    with running(tmp_path, device, {"users_file": "users"}, rates=rates) as gateway:
        def answers(user, requests, is_stopped=False):
            with json_socket(gateway.port, basic(user)) as link:
                if is_stopped:  # so that none is answered before the last one is there
                    service.pause()
                for number, request in enumerate(requests):
                    link.send(json.dumps({"id": number, **request}))
                found = {}
                while len(found) < len(requests):
                    answer = json.loads(link.recv(20))
                    if is_stopped and "error" in answer:
                        service.resume()
                    if "id" in answer:
                        found[answer["id"]] = answer
                return list(found.values())

        def is_refused(answer, of):
            error = answer.get("error")
            return error is not None and error["name"] == "RobotRaconteur.OutOfSystemResource" and \
                error["retry_after"] == 1 and "asked for more than" in error["message"] and of in error["message"]

        # One after the other, so that never two are on their way.
        with json_socket(gateway.port, basic("alice")) as link:
            found = []
            for number in range(40):
                link.send(json.dumps({"id": number, "op": "get", "path": "p_double"}))
                found.append(json.loads(link.recv(20)))
        assert "result" in found[0]
        refused = [answer for answer in found if "error" in answer]
        assert refused and all(is_refused(answer, "5 requests a second of") for answer in refused), refused
        # Many at once: some are too many, and none is left without an answer.
        found = answers("root", [{"op": "get", "path": "p_double"}] * 4, is_stopped=True)
        assert any("result" in answer for answer in found) and any(is_refused(answer, "2 at once to device") for answer in found), found
        # What is sent on a wire is no request.
        found = answers("vera", [{"op": "send", "path": "both", "value": 1.0}] * 40)
        assert all("result" in answer for answer in found), found


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


def test_credentials_are_the_devices_where_the_gateway_has_no_users(device, tmp_path):
    with running(tmp_path, device, {}) as gateway:
        assert ask(gateway.port, "GET", BASE + "/p_double").status == 200
        assert ask(gateway.port, "GET", "/api/v1/access").json["login"] is False
        # The device has no users either, and says so: they got there.
        assert ask(gateway.port, "GET", BASE + "/p_double", headers=basic("alice")).status != 200


def test_who_lets_everybody_in_must_say_so(tmp_path):
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({"listen": ["0.0.0.0:0"], "devices": []}))
    done = subprocess.run([RRGATE, "check-config", config], capture_output=True, text=True, timeout=30)
    assert done.returncode == 2 and '"insecure": true' in done.stderr
    gateway = Gateway(tmp_path, {"listen": ["0.0.0.0:0"], "devices": [], "insecure": True})
    try:
        assert "without TLS" in gateway.wait_for("insecure")["why"]
    finally:
        gateway.process.stop()


def test_passwd_and_token(tmp_path):
    users, tokens = tmp_path / "secret" / "users", tmp_path / "secret" / "tokens"
    assert "added" in rrgate("passwd", users, "alice", "--roles", "a,b", given="one\n")
    assert users.stat().st_mode & 0o777 == 0o600 and users.parent.stat().st_mode & 0o777 == 0o700
    first = users.read_text()
    assert first.startswith("alice $scrypt$ln=") and first.endswith(" a,b\n")
    rrgate("passwd", users, "bob", given="two\n")
    assert "changed" in rrgate("passwd", users, "alice", given="three\n")
    alice, bob = users.read_text().splitlines()
    assert alice.endswith(" a,b") and not first.startswith(alice) and bob.startswith("bob ") and bob.endswith(" _")
    assert "deleted" in rrgate("passwd", users, "alice", "--delete")
    assert users.read_text() == bob + "\n"
    token = rrgate("token", tokens, "ci", "--roles", "a", "--days", 1)
    assert token.startswith("rrg_") and token not in tokens.read_text()
    rrgate("token", tokens, "ci", "--delete")
    assert tokens.read_text() == ""
    for arguments, given in [(["passwd", users, "alice"], "\n"), (["passwd", users, "alice"], ""), (["passwd", users, "a:b"], "x\n"),
                             (["passwd", users, "alice", "--delete"], ""), (["passwd", users, "alice", "--roles", "a b"], "x\n"),
                             (["token", tokens, "ci", "--delete"], ""), (["token", tokens, "x", "--days", "0"], ""),
                             (["passwd", tmp_path, "alice"], "x\n"), (["passwd", users], "")]:
        done = subprocess.run([RRGATE, *map(str, arguments)], input=given, capture_output=True, text=True, timeout=30)
        assert done.returncode in (1, 2) and done.stderr.startswith("rrgate "), (arguments, done)
    assert users.read_text() == bob + "\n"


def json_socket(port, headers={}, path=BASE):
    return websockets.sync.client.connect(f"ws://127.0.0.1:{port}{path}", additional_headers=headers,
                                          subprotocols=[JSON_PROTOCOL], proxy=None)


def test_rights_over_json_on_a_websocket(guarded):
    for headers, status in (({}, 401), (basic("alice", "wrong"), 401)):
        with pytest.raises(websockets.exceptions.InvalidStatus) as refused:
            json_socket(guarded.port, headers)
        assert refused.value.response.status_code == status
    requests = {
        "read": {"op": "get", "path": "p_double"}, "write": {"op": "set", "path": "p_double", "value": 1.5},
        "call": {"op": "call", "path": "add", "args": {"left": 1, "right": 2}}, "other write": {"op": "set", "path": "p_int32", "value": 1},
        "other call": {"op": "call", "path": "nothing"}, "memory": {"op": "write", "path": "m_numbers", "offset": [3], "value": [1]},
        "below": {"op": "get", "path": "head/name"}, "below call": {"op": "call", "path": "head/identify"},
        "event": {"op": "subscribe", "path": "cleared"}, "lock": {"op": "lock", "path": ""}, "unlock": {"op": "unlock", "path": ""},
    }
    may = {"vera": {"read", "below", "event"}, "alice": {"read", "write", "call", "below", "event"}}
    for user in may:
        with json_socket(guarded.port, basic(user)) as link:
            for number, (what, request) in enumerate(requests.items()):
                link.send(json.dumps({"id": number, **request}))
                answer = json.loads(link.recv(10))
                while "id" not in answer:
                    answer = json.loads(link.recv(10))
                if what in may[user]:
                    assert "result" in answer, (user, what, answer)
                else:
                    assert answer["error"]["name"] == "RobotRaconteur.PermissionDenied", (user, what, answer)
                    assert "may not" in answer["error"]["message"]
    ticket = ask(guarded.port, "POST", "/api/v1/tickets", headers=basic("vera")).json["ticket"]
    with json_socket(guarded.port, path=f"{BASE}?ticket={ticket}") as link:
        link.send(json.dumps({"id": 1, "op": "get", "path": "p_double"}))
        assert "result" in json.loads(link.recv(10))
