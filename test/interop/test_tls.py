"""TLS between nodes: the reference and ours, each as service and as client, with certificates good and bad."""
import json

import pytest

from clients import check_all
from processes import BUILD, Background
from scenarios import FUNCTIONS
from tap import Tap
from tls_nodes import CLIENT, TLS_VERSIONS, run_steps, start_service

IS_TLS_1_3 = b"\x00\x2b\x00\x02\x03\x04"  # the extension by which a ServerHello says so


@pytest.fixture(scope="module", params=["reference", "ours"])
def service(request, lab, tmp_path_factory):
    """A service with a good certificate: (who made it, port)."""
    process, port = start_service(request.param, lab, "good", tmp_path_factory.mktemp("service"))
    yield request.param, port
    process.stop()


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
