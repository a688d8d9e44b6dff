"""Many clients of one device through the gateway, and what one of them can do to the others."""
import pytest

from load import Clients, Device, Gateway, running

CLIENTS = 200
MODES = {"relay": {}, "shared": {"mode": "shared"}}
OTHERS = 10
BULK = {"packet_rate": 100, "packet_bytes": 65536}  # fills the buffers of a connection within two seconds


@pytest.fixture(params=list(MODES))
def mode(request):
    return request.param


def test_all_get_values(tmp_path, mode):
    with running(Device(tmp_path)) as device, running(Gateway(tmp_path, device.url, MODES[mode])) as gateway:
        with running(Clients(tmp_path, gateway.url(), CLIENTS)) as clients:
            assert clients.wait_until_ready()["ready"] == CLIENTS
            assert device.connections() == {"relay": CLIENTS, "shared": 1}[mode]
            report = clients.finish()
            assert report["lost"] == report["failed"] == {}


def test_objects_below_the_root(tmp_path, mode):
    with running(Device(tmp_path)) as device, running(Gateway(tmp_path, device.url, MODES[mode])) as gateway:
        with running(Clients(tmp_path, gateway.url("rr+ws"), 20, wire="arm.state")) as clients:
            assert clients.wait_until_ready()["ready"] == 20


@pytest.mark.parametrize("scheme", ["rr+tcp", "rr+ws"])
def test_one_stops_reading(tmp_path, mode, scheme):
    """It is closed, with a reason in the log; the others get every packet meanwhile."""
    with running(Device(tmp_path, **BULK)) as device, \
            running(Gateway(tmp_path, device.url, MODES[mode], timeouts={"send_stall_ms": 1000})) as gateway, \
            running(Clients(tmp_path, gateway.url(scheme), OTHERS, name="others", pipe="packets")) as others, \
            running(Clients(tmp_path, gateway.url(scheme), 1, "--stalled", 1, name="stalled", pipe="packets")) as stalled:
        assert others.wait_until_ready()["ready"] == OTHERS
        assert stalled.wait_until_ready()["ready"] == 1
        before = gateway.resident_bytes()
        end = gateway.wait_for("client disconnected")
        assert end["reason"] == {"relay": "client too slow", "shared": "peer too slow: it takes no data"}[mode], end
        assert gateway.resident_bytes() < before + 16 * 1024 * 1024
        assert stalled.resume() in ("the peer closed the connection", "connection lost: Connection reset by peer")
        report = others.finish()
        assert (report["ready"], report["lost"], report["packet_gaps"]) == (OTHERS, {}, 0), report
        assert report["packets"] > OTHERS


@pytest.mark.parametrize("scheme", ["rr+tcp", "rr+ws"])
def test_all_come_back(tmp_path, mode, scheme):
    """The gateway dies without a word and starts again."""
    with running(Device(tmp_path)) as device, running(Gateway(tmp_path, device.url, MODES[mode])) as gateway:
        with running(Clients(tmp_path, gateway.url(scheme), CLIENTS, "--storm")) as clients:
            assert clients.wait_until_ready()["ready"] == CLIENTS
            gateway.kill()
            gateway.start()
            assert clients.wait_until_ready()["ready"] == CLIENTS
            assert device.connections() == {"relay": CLIENTS, "shared": 1}[mode]
            report = clients.finish()
            assert sum(report["lost"].values()) == report["reconnects"] == CLIENTS, report
