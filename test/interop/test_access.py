"""Who may do what: users, tokens, certificates, proxies and rights, over HTTP, WebSockets and Robot Raconteur."""
import contextlib
import itertools
import json
import subprocess
import sys

import issuers
import pytest
import websockets.sync.client

from access_gateways import NATIVE_CLIENT, audit_of, json_socket, running
from gateways import RRGATE, Gateway, make_web_certificates, rrgate
from http_api import BASE, JSON_PROTOCOL, ask, open_websocket, schemathesis, upgrade_status
from users import PASSWORDS, RULES, basic, bearer, make_users


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


def test_everybody_sees_what_he_may(guarded):
    port = guarded.port
    for path in ("/api/v1/devices", "/api/v1/devices/interop", BASE, BASE + "/p_double", "/metrics"):
        refused = ask(port, "GET", path)
        assert refused.status == 401, path
        assert refused.headers.get_all("WWW-Authenticate") == ['Bearer realm="rrgate"', 'Basic realm="rrgate", charset="UTF-8"']
        assert refused.headers["Content-Type"] == "application/problem+json"
    for path in ("/healthz", "/readyz"):
        assert ask(port, "GET", path).status == 200, path
    assert ask(port, "GET", "/api/v1/recordings").status == 401
    assert ask(port, "GET", "/api/v1/recordings", headers=basic("vera")).json["recordings"] == []
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


def test_a_body_that_is_too_large_is_refused_as_the_document_says(device, tmp_path):
    make_users(tmp_path)
    (tmp_path / "tokens").touch(0o600)
    with running(tmp_path, device, {"users_file": "users", "tokens_file": "tokens", "rules": RULES}) as gateway:
        paths = ask(gateway.port, "GET", "/api/v1/openapi.json").json["paths"]
        posted = {path.replace("{", "").replace("}", ""): each["post"] for path, each in paths.items() if "post" in each}
        assert len(posted) >= 10
        del posted["/api/v1/tickets"]  # takes none
        for path, operation in posted.items():
            refused = ask(gateway.port, "POST", path, "x" * 70_000, basic("root"))
            assert str(refused.status) in operation["responses"], (path, refused)
            assert refused.status in (404, 413), (path, refused)


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
    gateway = Gateway(tmp_path, {"listen": ["127.0.0.1:0"], "devices": [], "trusted_proxies": ["127.0.0.1"]})
    try:
        caution = gateway.wait_for("caution")
        assert caution["at"] == "/access/rules" and "everybody whom a proxy lets through may do everything" in caution["why"]
    finally:
        gateway.process.stop()


def test_passwd_and_token(tmp_path):
    users, tokens = tmp_path / "secret" / "users", tmp_path / "secret" / "tokens"
    assert "added" in rrgate("passwd", users, "alice", "--roles", "a,b", given="one\n")
    assert users.stat().st_mode & 0o777 == 0o600 and users.parent.stat().st_mode & 0o777 == 0o700
    beside = users.with_suffix(".new")
    beside.write_text("somebody's own")
    first = users.read_text()
    assert first.startswith("alice $scrypt$ln=") and first.endswith(" a,b\n")
    rrgate("passwd", users, "bob", given="two\n")
    assert "changed" in rrgate("passwd", users, "alice", given="three\n")
    alice, bob = users.read_text().splitlines()
    assert alice.endswith(" a,b") and not first.startswith(alice) and bob.startswith("bob ") and bob.endswith(" _")
    assert "deleted" in rrgate("passwd", users, "alice", "--delete")
    assert users.read_text() == bob + "\n"
    assert beside.read_text() == "somebody's own" and set(users.parent.iterdir()) == {users, beside}
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
