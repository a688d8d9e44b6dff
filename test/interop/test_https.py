"""The gateway and TLS: HTTPS as a scanner sees it, the reference's clients by wss, devices by rrs+tcp."""
import json
import socket

import pytest
from sslyze import ScanCommand, Scanner, ServerNetworkLocation, ServerScanRequest

from clients import check_all
from directions import LEVELS
from gateways import RRGATE, make_web_certificates
from processes import Background, free_port, start_gateway
from scenarios import FUNCTIONS
from tls_nodes import SERVICE, run_steps, start_service


@pytest.fixture(scope="module", params=["reference", "ours"])
def secure_device(request, lab, tmp_path_factory):
    """A service with a certificate: (who made it, port)."""
    # Where the HTTPS is not the service's own it cannot know of it, and the reference's client dies of a string table.
    process, port = start_service(request.param, lab, "good", tmp_path_factory.mktemp("device"), *LEVELS["v4"])
    yield request.param, port
    process.stop()


@pytest.fixture(scope="module")
def https(lab, secure_device, tmp_path_factory):
    """A gateway with HTTPS before a device by rrs+tcp: (who made the device, port, CA file)."""
    maker, device_port = secure_device
    folder = tmp_path_factory.mktemp("https")
    tls = make_web_certificates(folder / "web")
    url = f"rrs+tcp://127.0.0.1:{device_port}/?nodeid={SERVICE}&service=interop"
    gateway, port = start_gateway(folder, url, device={"tls": {"ca": [str(lab / "ca.pem")]}}, tls=tls)
    yield maker, port, folder / "web" / "web-ca.pem"
    gateway.stop()


def test_a_device_by_tls_for_clients_in_clear(lab, https, carries):
    maker, port, _ = https
    for client in ("reference", "ours"):
        carries(client, maker, "rr+tcp", "rrs+tcp")
        check_all(FUNCTIONS.steps, run_steps(client, lab, port, scheme="rr+tcp"))


@pytest.mark.parametrize("client", ["reference", "ours"])
def test_clients_by_wss(lab, https, monkeypatch, client, carries):
    maker, port, ca = https
    carries(client, maker, "rr+wss", "rrs+tcp")
    monkeypatch.setenv("SSL_CERT_FILE", str(ca))
    check_all(FUNCTIONS.steps, run_steps(client, lab, port, scheme="rr+wss"))


def test_the_index_over_https_has_urls_over_https(https, node, tmp_path, monkeypatch):
    """Of the gateway's own service, by the reference's client."""
    _, port, ca = https
    monkeypatch.setenv("SSL_CERT_FILE", str(ca))
    index = node.ConnectService(f"rr+wss://localhost:{port}/gateway?service=RobotRaconteurServiceIndex")
    urls = {service.Name: service.ConnectionURL[1] for service in index.GetLocalNodeServices().values()}
    root = node.ConnectService(urls["gateway"])
    assert [device.name for device in root.devices] == ["interop"]
    for each in (root, index):
        node.DisconnectService(each)


@pytest.mark.parametrize("scheme", ["rrs+tcp", "rrs+ws", "rrs+wss"])
def test_tls_from_end_to_end_through_the_gateway(lab, secure_device, tmp_path, monkeypatch, scheme, carries):
    maker, device_port = secure_device
    tls = make_web_certificates(tmp_path / "web")
    monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "web" / "web-ca.pem"))
    gateway, port = start_gateway(tmp_path, f"rr+tcp://127.0.0.1:{device_port}/?service=interop", tls=tls)
    try:
        for client in ("reference", "ours"):
            carries(client, maker, scheme, "rr+tcp")
            check_all(FUNCTIONS.steps, run_steps(client, lab, port, scheme=scheme, has_certificate=True))
    finally:
        gateway.stop()


@pytest.fixture(scope="module")
def tls_front(secure_device, tmp_path_factory):
    """A proxy with HTTPS before the service, since no node has HTTPS of its own: (who made the service, port, CA file)."""
    maker, service_port = secure_device
    folder, port = tmp_path_factory.mktemp("front"), free_port()
    files = make_web_certificates(folder / "web")["certificates"][0]
    pem = folder / "both.pem"
    pem.write_text("".join(open(files[kind]).read() for kind in ("cert", "key")))
    (folder / "haproxy.cfg").write_text(
        "global\n  tune.ssl.default-dh-param 2048\n"
        "defaults\n  mode tcp\n  timeout connect 5s\n  timeout client 60s\n  timeout server 60s\n"
        f"listen front\n  bind 127.0.0.1:{port} ssl crt {pem}\n  server service 127.0.0.1:{service_port}\n")
    proxy = Background(["haproxy", "-db", "-f", folder / "haproxy.cfg"], folder / "haproxy.log")
    proxy.wait_until(lambda: accepts(port))
    yield maker, port, folder / "web" / "web-ca.pem"
    proxy.stop()


def accepts(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.parametrize("client", ["reference", "ours"])
@pytest.mark.parametrize("scheme", ["rr+wss", "rrs+wss"])
def test_wss_to_a_service_behind_a_proxy(lab, tls_front, monkeypatch, scheme, client, carries):
    maker, port, ca = tls_front
    monkeypatch.setenv("SSL_CERT_FILE", str(ca))
    carries(client, maker, scheme)
    check_all(FUNCTIONS.steps, run_steps(client, lab, port, scheme=scheme, has_certificate=True))


@pytest.mark.parametrize("scheme", ["rr+ws", "rrs+ws", "rr+wss", "rrs+wss"])
def test_devices_by_websocket(lab, secure_device, tls_front, tmp_path, monkeypatch, scheme, carries):
    maker, port = secure_device
    if scheme.endswith("wss"):
        _, port, ca = tls_front
        monkeypatch.setenv("SSL_CERT_FILE", str(ca))
    secure = {"tls": {"ca": [str(lab / "ca.pem")]}} if scheme.startswith("rrs") else {}
    gateway, port = start_gateway(tmp_path, f"{scheme}://127.0.0.1:{port}/?service=interop", device=secure)
    try:
        carries("ours", maker, "rr+tcp", scheme)
        check_all(FUNCTIONS.steps, run_steps("ours", lab, port, node="", scheme="rr+tcp"))
    finally:
        gateway.stop()


def test_a_device_with_another_ca_stays_offline(lab, secure_device, tmp_path):
    _, device_port = secure_device
    tls = make_web_certificates(tmp_path / "web")
    port = free_port()
    config = tmp_path / "gateway.json"
    device = {"name": "interop", "url": f"rrs+tcp://127.0.0.1:{device_port}/?service=interop",
              "tls": {"ca": [str(tmp_path / "web" / "node-ca.pem")]}}
    config.write_text(json.dumps({"listen": [f"127.0.0.1:{port}"], "devices": [device], "tls": tls}))
    gateway = Background([RRGATE, "serve", "--config", config], tmp_path / "gateway.log")
    try:
        gateway.wait_until(lambda: "no trusted CA" in (tmp_path / "gateway.log").read_text()
                           or "is not trusted here" in (tmp_path / "gateway.log").read_text())
    finally:
        gateway.stop()


def test_what_a_scanner_finds(https):
    _, port, _ = https
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


