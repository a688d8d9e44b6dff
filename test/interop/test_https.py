"""The gateway and TLS: HTTPS as a scanner sees it, the reference's clients by wss, devices by rrs+tcp."""
import json

import pytest
from sslyze import ScanCommand, Scanner, ServerNetworkLocation, ServerScanRequest

from processes import BUILD, Background, free_port, start_gateway
from test_tls import FUNCTIONS, SERVICE, check_all, lab, run_steps, start_service  # noqa: F401

RRGATE = BUILD / "server" / "rrgate"


@pytest.fixture(scope="module", params=["reference", "ours"])
def secure_device(request, lab, tmp_path_factory):  # noqa: F811
    """A service with a certificate: its port."""
    process, port = start_service(request.param, lab, "good", tmp_path_factory.mktemp("device"))
    yield port
    process.stop()


def make_web_certificates(folder):
    for arguments in (["ca", folder], ["web", folder, "localhost", "127.0.0.1"]):
        process = Background([RRGATE, "cert", *arguments], folder.parent / "cert.log")
        assert process.process.wait(30) == 0, process.description()
        process.stop()
    return {"certificates": [{"cert": str(folder / "localhost.pem"), "key": str(folder / "localhost.key")}]}


@pytest.fixture(scope="module")
def https(lab, secure_device, tmp_path_factory):  # noqa: F811
    """A gateway with HTTPS before a device by rrs+tcp: (port, CA file)."""
    folder = tmp_path_factory.mktemp("https")
    tls = make_web_certificates(folder / "web")
    url = f"rrs+tcp://127.0.0.1:{secure_device}/?nodeid={SERVICE}&service=interop"
    gateway, port = start_gateway(folder, url, device={"tls": {"ca": [str(lab / "ca.pem")]}}, tls=tls)
    yield port, folder / "web" / "web-ca.pem"
    gateway.stop()


def test_a_device_by_tls_for_clients_in_clear(lab, https):  # noqa: F811
    port, _ = https
    for client in ("reference", "ours"):
        check_all(FUNCTIONS.steps, run_steps(client, lab, port, scheme="rr+tcp"))


@pytest.mark.parametrize("client", ["reference", "ours"])
def test_clients_by_wss(lab, https, monkeypatch, client):  # noqa: F811
    port, ca = https
    monkeypatch.setenv("SSL_CERT_FILE", str(ca))
    check_all(FUNCTIONS.steps, run_steps(client, lab, port, scheme="rr+wss"))


def test_tls_from_end_to_end_through_the_gateway(lab, secure_device, tmp_path):  # noqa: F811
    gateway, port = start_gateway(tmp_path, f"rr+tcp://127.0.0.1:{secure_device}/?service=interop")
    try:
        for client in ("reference", "ours"):
            check_all(FUNCTIONS.steps, run_steps(client, lab, port, has_certificate=True))
    finally:
        gateway.stop()


def test_a_device_with_another_ca_stays_offline(lab, secure_device, tmp_path):  # noqa: F811
    tls = make_web_certificates(tmp_path / "web")
    port = free_port()
    config = tmp_path / "gateway.json"
    device = {"name": "interop", "url": f"rrs+tcp://127.0.0.1:{secure_device}/?service=interop",
              "tls": {"ca": [str(tmp_path / "web" / "node-ca.pem")]}}
    config.write_text(json.dumps({"listen": [f"127.0.0.1:{port}"], "devices": [device], "tls": tls}))
    gateway = Background([RRGATE, "serve", "--config", config], tmp_path / "gateway.log")
    try:
        gateway.wait_until(lambda: "no trusted CA" in (tmp_path / "gateway.log").read_text()
                           or "is not trusted here" in (tmp_path / "gateway.log").read_text())
    finally:
        gateway.stop()


def test_what_a_scanner_finds(https):
    port, _ = https
    scanner = Scanner()
    commands = {ScanCommand.SSL_2_0_CIPHER_SUITES, ScanCommand.SSL_3_0_CIPHER_SUITES, ScanCommand.TLS_1_0_CIPHER_SUITES,
                ScanCommand.TLS_1_1_CIPHER_SUITES, ScanCommand.TLS_1_2_CIPHER_SUITES, ScanCommand.TLS_1_3_CIPHER_SUITES,
                ScanCommand.TLS_COMPRESSION, ScanCommand.SESSION_RENEGOTIATION, ScanCommand.HEARTBLEED,
                ScanCommand.OPENSSL_CCS_INJECTION, ScanCommand.ROBOT, ScanCommand.TLS_FALLBACK_SCSV}
    location = ServerNetworkLocation("localhost", port, "127.0.0.1")
    scanner.queue_scans([ServerScanRequest(location, scan_commands=commands)])
    (found,) = scanner.get_results()
    assert found.scan_result, found.connectivity_error_trace
    results = {command: getattr(found.scan_result, command.value) for command in commands}
    for command, attempt in results.items():
        assert attempt.result, f"{command}: {attempt.error_trace}"
    results = {command: attempt.result for command, attempt in results.items()}

    for old in (ScanCommand.SSL_2_0_CIPHER_SUITES, ScanCommand.SSL_3_0_CIPHER_SUITES, ScanCommand.TLS_1_0_CIPHER_SUITES,
                ScanCommand.TLS_1_1_CIPHER_SUITES):
        assert results[old].accepted_cipher_suites == [], old
    names = {suite.cipher_suite.name for suite in results[ScanCommand.TLS_1_2_CIPHER_SUITES].accepted_cipher_suites}
    assert names
    for name in names:
        assert name.startswith("TLS_ECDHE_") and ("_GCM_" in name or "_CHACHA20_" in name), name
    assert results[ScanCommand.TLS_1_3_CIPHER_SUITES].accepted_cipher_suites
    assert not results[ScanCommand.TLS_COMPRESSION].supports_compression
    assert not results[ScanCommand.SESSION_RENEGOTIATION].is_vulnerable_to_client_renegotiation_dos
    assert not results[ScanCommand.HEARTBLEED].is_vulnerable_to_heartbleed
    assert not results[ScanCommand.OPENSSL_CCS_INJECTION].is_vulnerable_to_ccs_injection
    assert "VULNERABLE" not in results[ScanCommand.ROBOT].robot_result.name.replace("NOT_VULNERABLE", "")


