"""The example of a node inside of a web server: WebSockets that Beast has accepted, for the reference's client and ours."""
import subprocess
import sys
import urllib.request

import pytest

from clients import run_program
from http_api import upgrade_status
from processes import BUILD, Background

REFERENCE = """
import sys
from RobotRaconteur.Client import RRN
arm = RRN.ConnectService(sys.argv[1])
arm.turn(30.0)
arm.turn(12.5)
print(arm.angle)
"""


@pytest.fixture
def url(tmp_path):
    server = Background([BUILD / "test/interop/cpp/rr-example-web-server", "0"], tmp_path / "server.log")
    try:
        yield server.next_line()
    finally:
        server.stop()


def test_the_reference_uses_a_device_inside_of_a_web_server(url):
    client = subprocess.run([sys.executable, "-c", REFERENCE, url], capture_output=True, text=True, timeout=60)
    assert client.stdout == "42.5\n", client.stderr


def test_our_client_does_and_the_server_answers_requests_beside_it(url):
    steps = [{"call": "turn", "args": [{"double": 30.0}]}, {"call": "turn", "args": [{"double": 12.5}]}, {"get": "angle"}]
    results = run_program([BUILD / "test/interop/cpp/rr-test-client", url], steps)["results"]
    assert [result.get("value", result) for result in results] == [None, None, 42.5]
    page = url.split("/arm")[0].replace("rr+ws", "http")
    with urllib.request.urlopen(page, timeout=10) as answer:
        assert answer.read() == b"This arm has 0 clients.\n"


def test_pages_of_all_sites_are_refused(url):
    port = int(url.split("/arm")[0].split(":")[-1])
    for origin in "https://elsewhere.example", f"http://127.0.0.1:{port}", "null", "":
        assert upgrade_status(port, "/arm", {"Origin": origin}) == 403, origin
    assert upgrade_status(port, "/arm") == 101
