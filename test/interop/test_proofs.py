"""How somebody proves who he is: tokens of issuers, certificates, sign-ins, and what trusted proxies say."""
import concurrent.futures
import contextlib
import http.client
import json
import shutil
import ssl
import subprocess
import sys
import time

import issuers
import pytest

from access_gateways import NATIVE_CLIENT, audit_of, cookie_of, ends, running
from gateways import make_web_certificates, rrgate
from http_api import BASE, Stream, ask, is_alive, open_websocket, upgrade_status
from users import PASSWORDS, RULES, basic, bearer, make_users


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


def test_signing_out_that_no_folder_keeps_is_told(device, tmp_path, monkeypatch):
    """As in a service without HOME: until the gateway starts again it holds."""
    for name in ("ROBOTRACONTEUR_SYSTEM_STATE_DIR", "ROBOTRACONTEUR_USER_CONFIG_DIR"):  # of root, and of others
        monkeypatch.setenv(name, "of-no-use")
    make_users(tmp_path)
    (tmp_path / "ticket.key").write_text("of this test alone " * 3)
    for key, told in (({}, 0), ({"ticket_key_file": "ticket.key"}, 1)):  # without it, no cookie outlives the gateway
        with running(tmp_path, device, {"users_file": "users", "rules": RULES, **key}) as gateway:
            page = {"Origin": f"http://127.0.0.1:{gateway.port}"}
            made = ask(gateway.port, "POST", "/api/v1/session", {"user": "alice", "password": PASSWORDS["alice"]}, page)
            signed = {**page, "Cookie": cookie_of(made)}
            assert ask(gateway.port, "DELETE", "/api/v1/session", headers=signed).status == 204
            assert ask(gateway.port, "GET", "/api/v1/access", headers=signed).json["user"] is None
        warnings = gateway.events("signing out can't be kept: after a restart a copied cookie is good again")
        assert len(warnings) == told
        assert all("ROBOTRACONTEUR_" in each["error"] for each in warnings), warnings


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
def publishing(folder, device, tls_of=None, access={}, **served):
    """(server, gateway): an issuer's server, and a gateway that takes its keys from there; `access` is more of its
    configuration."""
    make_web_certificates(folder / "id")
    make_web_certificates(folder / "other")
    server = issuers.IssuerServer(folder / "id" / "localhost.pem", folder / "id" / "localhost.key")
    for name, value in served.items():
        setattr(server, name, value)
    jwt = {"discover": True, "issuer": server.url, "audience": "rrgate", "ca": [str(folder / (tls_of or "id") / "web-ca.pem")]}
    token = rrgate("token", folder / "tokens", "ci", "--roles", "admin")
    try:
        with running(folder, device, {"jwt": jwt, "tokens_file": "tokens", "rules": RULES, **access}) as gateway:
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


@pytest.mark.parametrize("shown", ["cookie", "ticket"])
def test_what_another_gateway_gave_by_a_new_key_waits_for_that_key(device, tmp_path, shown):
    """The gateways have one ticket key; the one that the token came to has the issuer's new key already."""
    (tmp_path / "ticket.key").write_text("of this test alone " * 3)
    (tmp_path / "there").mkdir()
    shared = {"ticket_key_file": str(tmp_path / "ticket.key")}
    key_set = issuers.Issuer("", "rrgate").key_set()
    with publishing(tmp_path, device, access=shared, key_set=key_set) as (server, here):
        here.wait_for("keys of the issuer fetched")
        access = {"jwt": here.config["access"]["jwt"], "rules": RULES, **shared}
        with running(tmp_path / "there", device, access) as there:
            there.wait_for("keys of the issuer fetched")
            second = issuers.Issuer(server.url, "rrgate", "-2")
            server.key_set = second.key_set()
            proof = bearer(second.token("alice", ["admin"], "ES256"))
            if shown == "ticket":
                ticket = ask(here.port, "POST", "/api/v1/tickets", headers=proof).json["ticket"]
                assert upgrade_status(there.port, f"/devices/interop?ticket={ticket}") == 101
            else:
                page = {"Host": "localhost", "Origin": "http://localhost"}
                made = ask(here.port, "POST", "/api/v1/session", headers={**page, **proof})
                signed = {**page, "Cookie": cookie_of(made)}
                assert ask(there.port, "GET", "/api/v1/access", headers=signed).json["user"] == "alice"


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
        gateway.wait_for("client ended: what it has shown was revoked or has expired")
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
        gateway.wait_for("client ended: what it has shown was revoked or has expired", 2)
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
        gateway.wait_for("client ended: what it has shown was revoked or has expired")
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
