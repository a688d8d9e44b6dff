"""What single options of the configuration do, where no other test needs them."""
import json
import socket
import time

import pytest

import shared_sites
from agents import call
from clients import check_all
from gateways import running
from http_api import ask
from processes import start_gateway
from tls_nodes import run_steps, start_service

LARGE = "x" * 300_000
STEP = {"call": "echo", "args": [{"varvalue": LARGE}], "expect": LARGE}


def test_connect_ms_ends_a_dial_that_leads_to_nothing(tmp_path):
    """A device that takes the connection and never answers the upgrade."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"rr+ws://127.0.0.1:{silent.getsockname()[1]}/?service=s"
        begin = time.monotonic()
        with running(tmp_path, {"devices": [{"name": "silent", "url": url}], "timeouts": {"connect_ms": 300}}) as gateway:
            gateway.wait_for("device offline", device="silent")
            assert time.monotonic() - begin < 4  # of the 5 s that it is without the option
            (device,) = ask(gateway.port, "GET", "/api/v1/devices").json["devices"]
    assert device["state"] == "offline" and "300 ms" in json.dumps(device), device


def test_longest_wait_ms_bounds_what_an_agent_may_wait(tmp_path):
    device, url = shared_sites.start_service(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, mcp={"longest_wait_ms": 1000})
    try:
        event = {"device": "interop", "path": "interop/changed"}
        refused = call(port, "wait_for_event", seconds=1.5, **event)
        assert refused.is_error and "at most 1" in refused.structured_content["error"]["message"]
        begin = time.monotonic()
        waited = call(port, "wait_for_event", **event).structured_content
        assert waited["happened"] is False and time.monotonic() - begin < 8  # 10 s without the option
    finally:
        gateway.stop()
        device.stop()


@pytest.mark.parametrize("rate", [100_000, 1_000_000_000])
def test_opaque_rate_bounds_what_passes_unread(lab, tmp_path, rate):
    """TLS between the nodes: a tenth of a second's worth passes at once, the rest at the rate."""
    service, port = start_service("ours", lab, "good", tmp_path)
    gateway, front = start_gateway(tmp_path, f"rr+tcp://127.0.0.1:{port}/?service=interop", limits={"opaque_rate": rate})
    try:
        begin = time.monotonic()
        check_all([STEP], run_steps("ours", lab, front, [STEP]))
        took = time.monotonic() - begin
    finally:
        gateway.stop()
        service.stop()
    assert (took > 2) == (rate == 100_000), took
