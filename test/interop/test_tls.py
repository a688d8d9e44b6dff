"""TLS between nodes: the reference and ours, each as service and as client, with certificates good and bad."""
import json
import subprocess
import sys

import pytest

from clients import run_program
from directions import PEERS
from processes import BUILD, Background
from scenarios import SCENARIOS
from tap import Tap
from test_interop import check

SERVICE = "11111111-0000-4000-8000-000000000001"
CLIENT = "22222222-0000-4000-8000-000000000002"
FUNCTIONS = next(scenario for scenario in SCENARIOS if scenario.name == "functions")
TLS_VERSIONS = {"1.2": "TLSv1.2", "1.3": "TLSv1.3"}
IS_TLS_1_3 = b"\x00\x2b\x00\x02\x03\x04"  # the extension by which a ServerHello says so


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A folder with ca.pem and configuration folders by kind: good, expired, ..."""
    folder = tmp_path_factory.mktemp("lab")
    subprocess.run([BUILD / "test/interop/cpp/rr-test-certificates", folder, "{%s}" % SERVICE, "{%s}" % CLIENT], check=True)
    for name, version in TLS_VERSIONS.items():
        (folder / f"openssl-{name}.cnf").write_text(
            "openssl_conf = init\n[init]\nssl_conf = ssl\n[ssl]\nsystem_default = all\n"
            f"[all]\nMaxProtocol = {version}\n")
    return folder


def environment(lab, kind, version="1.3"):
    """What a program is told by its environment; both peers look where the reference does."""
    folder = str(lab / kind)
    return {"ROBOTRACONTEUR_SSL_CERT_FILE": str(lab / "ca.pem"),
            "ROBOTRACONTEUR_SYSTEM_CONFIG_DIR": folder, "ROBOTRACONTEUR_USER_CONFIG_DIR": folder,
            "OPENSSL_CONF": str(lab / f"openssl-{version}.cnf")}


def start_service(peer, lab, kind, folder, *options):
    command = {
        "reference": [sys.executable, PEERS / "service.py", f"--robotraconteur-nodeid={SERVICE}",
                      "--robotraconteur-load-tls=true"],
        "ours": [BUILD / "test/interop/cpp/rr-test-service", f"--robotraconteur-nodeid={SERVICE}",
                 "--robotraconteur-load-tls=true"],
    }[peer]
    service = Background([*command, *options], folder / "service.log", environment(lab, kind))
    try:
        return service, json.loads(service.next_line())["port"]
    except BaseException:
        service.stop()
        raise


@pytest.fixture(scope="module", params=["reference", "ours"])
def service(request, lab, tmp_path_factory):
    """A service with a good certificate: (who made it, port)."""
    process, port = start_service(request.param, lab, "good", tmp_path_factory.mktemp("service"))
    yield request.param, port
    process.stop()


def run_steps(peer, lab, port, steps=FUNCTIONS.steps, *, scheme="rrs+tcp", node=SERVICE, has_certificate=False, version="1.3"):
    """What the client prints: {"results": [...]} or {"connect_error": {...}}."""
    url = f"{scheme}://127.0.0.1:{port}/?nodeid={node}&service=interop" if node else f"{scheme}://127.0.0.1:{port}/?service=interop"
    command = {"reference": [sys.executable, PEERS / "client.py"], "ours": [BUILD / "test/interop/cpp/rr-test-client"]}[peer]
    options = [f"--robotraconteur-nodeid={CLIENT}", "--robotraconteur-load-tls=true"] if has_certificate else []
    return run_program([*command, url, *options], steps, environment(lab, "good", version))


def check_all(steps, answer):
    assert "results" in answer, answer
    for number, (step, result) in enumerate(zip(steps, answer["results"], strict=True), 1):
        check(f"step {number}: {json.dumps(step)[:400]}", step, result)


@pytest.mark.parametrize("version", TLS_VERSIONS)
@pytest.mark.parametrize("has_certificate", [False, True], ids=["anonymous", "certified"])
@pytest.mark.parametrize("client", ["reference", "ours"])
def test_encrypted(lab, service, client, has_certificate, version, carries):
    maker, port = service
    carries(client, maker, "rrs+tcp")
    if version == "1.2" and (maker, client) != ("reference", "ours"):
        version = "1.2" if client == "ours" else "1.3"  # the reference's OpenSSL reads no configuration
    tap = Tap(port)
    try:
        check_all(FUNCTIONS.steps, run_steps(client, lab, tap.port, has_certificate=has_certificate, version=version))
        seen = b"".join(bytes(stream) for stream in tap.streams)
    finally:
        tap.close()
    assert (IS_TLS_1_3 in seen) == (version == "1.3")
    assert b"STARTTLS" in seen and b"CreateConnection" not in seen


@pytest.mark.parametrize("client", ["reference", "ours"])
def test_over_websockets(lab, service, client, carries):
    maker, port = service
    carries(client, maker, "rrs+ws")
    check_all(FUNCTIONS.steps, run_steps(client, lab, port, scheme="rrs+ws", has_certificate=True))


@pytest.mark.parametrize("scheme", ["rrs+tcp", "rrs+ws", "rr+ws"])
def test_much_at_once(lab, service, scheme):
    """More messages than are written at a time, and nothing behind them that would take the rest along."""
    _, port = service
    fired = [[float(number), f"number {number}"] for number in range(500)]
    steps = [{"listen": "changed", "expect": None}, {"call": "fire", "args": [{"int32": len(fired)}], "expect": None},
             {"events": "changed", "count": len(fired), "any_order": True, "expect": {"list": fired}}]
    check_all(steps, run_steps("ours", lab, port, steps, scheme=scheme))


def test_both_ways_on_one_port(lab, service):
    maker, port = service
    check_all(FUNCTIONS.steps, run_steps("ours", lab, port, scheme="rr+tcp"))


@pytest.mark.parametrize("client", ["reference", "ours"])
@pytest.mark.parametrize("has_certificate", [False, True], ids=["anonymous", "certified"])
def test_who_is_known(lab, tmp_path, client, has_certificate):
    """A login that only clients with a certificate may try."""
    process, port = start_service("ours", lab, "good", tmp_path)
    try:
        step = {"open": "me", "service": "proven", "username": "alice", "password": "secret"}
        step |= {"expect": None} if has_certificate else {"expect_error": "RobotRaconteur.AuthenticationError"}
        check_all([step], run_steps(client, lab, port, [step], has_certificate=has_certificate))
    finally:
        process.stop()


REFUSED = {
    "expired": "expired at",
    "unmarked": "found no extension 1.3.6.1.4.1.45455.1.1.3.3",
    "other-ca": "is not trusted here|which is no trusted CA",
    "self-signed": "is self-signed",
    "other-node": "the certificate is of node",
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused_certificates_of_services(lab, tmp_path, kind):
    process, port = start_service("reference", lab, kind, tmp_path)
    try:
        answer = run_steps("ours", lab, port)
        message = answer["connect_error"]["message"]
        assert any(text in message for text in REFUSED[kind].split("|")), message
    finally:
        process.stop()


def test_the_wrong_node(lab, service):
    maker, port = service
    answer = run_steps("ours", lab, port, node=CLIENT)
    assert "Node not found" in answer["connect_error"]["message"], answer


def test_required(lab, tmp_path):
    process, port = start_service("ours", lab, "good", tmp_path, "--robotraconteur-require-tls=true")
    try:
        check_all(FUNCTIONS.steps, run_steps("reference", lab, port))
        assert "use rrs+tcp" in run_steps("ours", lab, port, scheme="rr+tcp")["connect_error"]["message"]
        assert "connect_error" in run_steps("reference", lab, port, scheme="rr+tcp")
    finally:
        process.stop()


def test_a_service_without_certificate(lab, tmp_path):
    process = Background([BUILD / "test/interop/cpp/rr-test-service"], tmp_path / "service.log")
    try:
        answer = run_steps("ours", lab, json.loads(process.next_line())["port"], node="")
        assert "Server certificate not loaded" in answer["connect_error"]["message"], answer
    finally:
        process.stop()
