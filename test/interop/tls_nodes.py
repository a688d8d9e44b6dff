"""Nodes with certificates: services and clients of either make that speak TLS."""
import json
import subprocess
import sys

from clients import run_program
from directions import PEERS
from processes import BUILD, Background
from scenarios import FUNCTIONS

SERVICE = "11111111-0000-4000-8000-000000000001"
CLIENT = "22222222-0000-4000-8000-000000000002"
TLS_VERSIONS = {"1.2": "TLSv1.2", "1.3": "TLSv1.3"}


def make_lab(folder):
    """ca.pem and configuration folders by kind: good, expired, ..."""
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


def run_steps(peer, lab, port, steps=FUNCTIONS.steps, *, scheme="rrs+tcp", node=SERVICE, has_certificate=False, version="1.3"):
    """What the client prints: {"results": [...]} or {"connect_error": {...}}."""
    url = f"{scheme}://127.0.0.1:{port}/?nodeid={node}&service=interop" if node else f"{scheme}://127.0.0.1:{port}/?service=interop"
    command = {"reference": [sys.executable, PEERS / "client.py"], "ours": [BUILD / "test/interop/cpp/rr-test-client"]}[peer]
    options = [f"--robotraconteur-nodeid={CLIENT}", "--robotraconteur-load-tls=true"] if has_certificate else []
    return run_program([*command, url, *options], steps, environment(lab, "good", version))
