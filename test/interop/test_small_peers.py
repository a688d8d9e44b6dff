"""Small peers, as the twelve sensors of the paper's conference room: each takes one connection at a time, some write over-long sizes, and
many clients use them."""
import json
import sys

from gateways import Gateway
from http_api import fetch
from processes import ROOT, Background


def test_many_clients_share_peers_that_take_one_connection_each(node, tmp_path):
    sensors = Background([sys.executable, ROOT / "test" / "interop" / "peers" / "small_sensors.py"], tmp_path / "sensors.log")
    try:
        ports = json.loads(sensors.next_line())
        names = [f"sensor-{number}" for number in range(len(ports))]
        gateway = Gateway(tmp_path, {"retry": {"min_ms": 100, "online_ms": 500}, "devices": [
            {"name": name, "url": f"rr+tcp://127.0.0.1:{port}/?service=Sensor", "mode": "shared"} for name, port in zip(names, ports)]})
        try:
            for name in names:
                gateway.wait_for("device online", device=name)
            url = f"rr+ws://127.0.0.1:{gateway.port}/devices/%s?service=Sensor"
            clients = [[node.ConnectService(url % name) for name in names] for _ in range(2)]
            for each in clients:
                assert [client.reading[0] for client in each] == list(range(12))
            wires = [client.readings.Connect() for each in clients for client in each]
            sensors.wait_until(lambda: all(wire.InValueValid for wire in wires))
            assert [list(wire.InValue) for wire in wires] == [[number, 100.0, 0.5] for number in range(12)] * 2
            for number, name in enumerate(names):
                status, _, body = fetch(gateway.port, f"/api/v1/devices/{name}/Sensor/reading")
                assert (status, json.loads(body)) == (200, [number, 100.0, 0.5])
            for wire in wires:
                wire.Close()
            for each in clients:
                for client in each:
                    node.DisconnectService(client)
            assert gateway.events("device offline") == []
        finally:
            gateway.process.stop()
    finally:
        sensors.stop()
