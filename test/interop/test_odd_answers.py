"""HTTP before a device that does what it is asked for, but whose answers can't be read, or don't come."""
import functools
import http.client
import json
import sys

import pytest

import http_api
from processes import ROOT, Background, free_port, start_gateway

BASE = "/api/v1/devices/interop/odd"
ask = functools.partial(http_api.ask, base=BASE)
SOON = 20  # seconds; far less than the minute that a device has for its answer


@pytest.fixture(params=["one session for all", "a session for each"])
def odd(request, tmp_path):
    """(the device, the port of a gateway to it)"""
    port = free_port()
    device = Background([sys.executable, ROOT / "test" / "interop" / "peers" / "odd_answers.py", port], tmp_path / "device.log")
    try:
        assert device.next_line() == "ready"
        mode = {"mode": "shared"} if request.param == "one session for all" else {}
        gateway, gateway_port = start_gateway(tmp_path, f"rr+tcp://127.0.0.1:{port}/?service=odd", device=mode)
        try:
            yield device, gateway_port
        finally:
            gateway.stop()
    finally:
        device.stop()


def test_what_was_done_is_not_told_as_refused(odd):
    device, gateway = odd
    moved = ask(gateway, "POST", "/move", {"to": 2})
    assert device.next_line() == "moved to 2.0"
    assert (moved.status, moved.json["error"]["name"]) == (502, "RobotRaconteur.ProtocolError"), moved.body
    assert "expected string" in moved.json["detail"]
    assert ask(gateway, "GET", "/place").status == 502
    assert ask(gateway, "POST", "/move", {"to": "there"}).status == 400  # that was not even sent


def test_a_generator_whose_value_cannot_be_read_is_closed(odd):
    device, gateway = odd
    lines = ask(gateway, "POST", "/moves").body.splitlines()
    assert [json.loads(line)["error"]["name"] for line in lines] == ["RobotRaconteur.ProtocolError"]
    assert [device.next_line(SOON), device.next_line(SOON)] == ["step", "closed"]


def test_a_reader_who_leaves_while_a_value_is_awaited_ends_its_generator(odd):
    device, gateway = odd
    connection = http.client.HTTPConnection("127.0.0.1", gateway, timeout=20)
    connection.request("POST", BASE + "/wait", "{}", {"Content-Type": "application/json"})
    response = connection.getresponse()
    assert response.status == 200
    assert device.next_line(SOON) == "step"
    response.close()
    connection.close()
    assert device.next_line(SOON) == "closed"
