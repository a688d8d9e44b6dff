"""A gateway behind a gateway: device <- far gateway <- near gateway <- client, each of the ways with TLS somewhere."""
import functools
import json
import signal
import sys

import pytest

from clients import check_all
from directions import LEVELS, PEERS
from gateways import Gateway, make_web_certificates, rrgate
import http_api
from http_api import BASE
from leases import PLAIN
from processes import Background, free_port, read_json, start_gateway
from scenarios import FUNCTIONS, SCENARIO
from shared_sites import RETRY, Site, port_of
from tls_nodes import SERVICE, run_steps, start_service
from users import basic, bearer

ask = functools.partial(http_api.ask, base=BASE)
Stream = functools.partial(http_api.Stream, base=BASE)

STEPS = [step for name in ("functions", "large_arrays", "events", "wires", "pipes") for step in SCENARIO[name].steps]


class Chain:
    """A device of either make with a certificate, and two gateways in a row before it."""

    def __init__(self, lab, maker, folder, far_scheme, near_scheme):
        """`far_scheme`: how the far gateway reaches the device; `near_scheme`: how the near one reaches the far one."""
        self._lab, self._folder, self._maker = lab, folder, maker
        self._tls = make_web_certificates(folder / "web")
        self.processes = []
        try:
            device, self.device_port = start_service(maker, lab, "good", folder, *LEVELS["v4"])
            self.processes.append(device)
            self.far_port = self._start("far", far_scheme, self.device_port)
            self.near_port = self._start("near", near_scheme, self.far_port)
            self._far_scheme = far_scheme
        except BaseException:
            self.stop()
            raise

    def _start(self, name, scheme, port, own_port=None):
        (self._folder / name).mkdir(exist_ok=True)
        path = "devices/interop" if "+ws" in scheme and name == "near" else ""
        url = f"{scheme}://127.0.0.1:{port}/{path}?nodeid={SERVICE}&service=interop"
        trust = {"tls": {"ca": [str(self._lab / "ca.pem")]}} if scheme.startswith("rrs") else {}
        gateway, port = start_gateway(self._folder / name, url, device=trust, tls=self._tls, port=own_port)
        self.processes.append(gateway)
        return port

    def kill_far(self):
        far = self.processes.pop(1)
        far.process.send_signal(signal.SIGKILL)
        far.stop()

    def restart_far(self):
        self._start("far", self._far_scheme, self.device_port, self.far_port)

    def near_device(self):
        return read_json(f"http://127.0.0.1:{self.near_port}/api/v1/devices")["devices"][0]

    def stop(self):
        for process in reversed(self.processes):
            process.stop()


@pytest.fixture(params=["reference", "ours"])
def maker(request):
    return request.param


WAYS = {
    # The near gateway checks the certificate of the device itself; the far one carries what it cannot read.
    "end to end": ("rr+tcp", "rrs+tcp"),
    # Each way for itself: what the far gateway reads in clear, it hands on by HTTPS.
    "hop by hop": ("rrs+tcp", "rr+wss"),
    "in clear behind the far one": ("rrs+tcp", "rr+tcp"),
}


@pytest.mark.parametrize("way", WAYS)
def test_two_gateways(lab, maker, tmp_path, monkeypatch, way):
    monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "web" / "web-ca.pem"))
    chain = Chain(lab, maker, tmp_path, *WAYS[way])
    try:
        for scheme in ("rr+tcp", "rr+ws"):
            check_all(STEPS, run_steps("reference", lab, chain.near_port, STEPS, scheme=scheme))
        assert ask(chain.near_port, "GET", "/version").json == "1"
        assert ask(chain.near_port, "POST", "/add", {"left": 1, "right": 2}).json == {"result": 3}
        stream = Stream(chain.near_port, "/changed")
        ask(chain.near_port, "POST", "/fire", {"count": 1})
        assert stream.next()[2]["value"] == 0
        stream.close()
    finally:
        chain.stop()


WHOLE = ["read", "write", "call", "subscribe", "lock"]
PLANT = {"rules": [{"roles": ["plant"], "devices": ["interop"], "may": WHOLE}]}


def protected_gateway(folder, device, mode, **access):
    """A far gateway that lets the near one in, and nobody else."""
    folder.mkdir()
    (folder / "tokens").touch(0o600)
    token = rrgate("token", folder / "tokens", "near", "--roles", "plant")
    rrgate("passwd", folder / "users", "near", "--roles", "plant", given="secret\n")
    far = Gateway(folder, {"devices": [{"name": "interop", "url": device, "mode": mode}],
                           "access": {"tokens_file": "tokens", "users_file": "users", **PLANT}, **access})
    far.wait_for("device online", device="interop")
    return far, token


@pytest.fixture(scope="module")
def bare_device(tmp_path_factory):
    service = Background([sys.executable, PEERS / "service.py"], tmp_path_factory.mktemp("device") / "service.log")
    yield json.loads(service.next_line())["url"]
    service.stop()


@pytest.mark.parametrize("near_mode", ["relay", "shared"])
@pytest.mark.parametrize("far_mode", ["relay", "shared"])
@pytest.mark.parametrize("scheme", ["rr+ws", "rr+wss"])
def test_the_far_gateway_asks_who_comes(lab, bare_device, tmp_path, scheme, far_mode, near_mode):
    """A token in the headers of the near one's device is the proof, for its looks and for its clients."""
    tls = make_web_certificates(tmp_path / "web")
    far, token = protected_gateway(tmp_path / "far", bare_device, far_mode, tls=tls)
    device = {"name": "interop", "url": f"{scheme}://localhost:{far.port}/devices/interop?service=interop", "mode": near_mode}
    if scheme == "rr+wss":
        device["tls"] = {"ca": [str(tmp_path / "web" / "web-ca.pem")]}
    proof = [{"name": "Authorization", "value": "Bearer " + token}]
    (tmp_path / "near").mkdir()
    near = Gateway(tmp_path / "near", {"devices": [device]})
    try:
        if far_mode == "relay":
            assert "401" in near.wait_for("device offline")["error"]
        else:  # there is a node, and nothing there for strangers
            near.wait_for("device online", device="interop")
            near.process.wait_until(lambda: ask(near.port, "GET", "/version").status == 401)
        near.write({**near.config, "devices": [{**device, "headers": proof}]})
        near.hang_up()
        near.wait_for("configuration read anew")
        near.process.wait_until(lambda: ask(near.port, "GET", "/version").status == 200)
        check_all(STEPS, run_steps("reference", lab, near.port, STEPS, scheme="rr+tcp", node=""))
        assert ask(near.port, "POST", "/add", {"left": 1, "right": 2}).json == {"result": 3}
        stream = Stream(near.port, "/changed")
        ask(near.port, "POST", "/fire", {"count": 1})
        assert stream.next()[2]["value"] == 0
        stream.close()
        assert ask(far.port, "GET", "/version").status == 401
        assert ask(far.port, "GET", "/version", headers=bearer(token)).json == "1"
    finally:
        near.process.stop()
        far.process.stop()


def test_a_device_that_is_listed_twice_is_relayed_by_its_node(bare_device, tmp_path):
    twice = [{"name": "robot", "url": bare_device, "mode": "shared"}, {"name": "own", "url": bare_device}]
    gateway = Gateway(tmp_path, {"devices": twice})
    try:
        for device in twice:
            gateway.wait_for("device online", device=device["name"])
        listed = read_json(f"http://127.0.0.1:{gateway.port}/api/v1/devices")["devices"]
        nodes = {device["name"]: device["node_id"] for device in listed}
        for node in (f"nodeid={nodes['own']}", "nodename=robot"):
            assert rrgate("get", f"rr+tcp://127.0.0.1:{gateway.port}/?{node}&service=interop", "version") == "1"
    finally:
        gateway.process.stop()


def test_the_near_gateway_logs_in_at_the_far_one(lab, bare_device, tmp_path):
    """As a user of the far one's, where both share the device: without a login it gets to no service."""
    far, _ = protected_gateway(tmp_path / "far", bare_device, "shared")
    device = {"name": "interop", "url": f"rr+tcp://127.0.0.1:{far.port}/?nodename=interop&service=interop", "mode": "shared"}
    (tmp_path / "near").mkdir()
    near = Gateway(tmp_path / "near", {"devices": [device]})
    try:
        near.wait_for("device online", device="interop")
        near.process.wait_until(lambda: ask(near.port, "GET", "/version").status == 401)
        near.write({**near.config, "devices": [{**device, "login": {"username": "near", "password": "secret"}}]})
        near.hang_up()
        near.wait_for("configuration read anew")
        near.process.wait_until(lambda: ask(near.port, "GET", "/version").status == 200)
        check_all(STEPS, run_steps("reference", lab, near.port, STEPS, scheme="rr+tcp", node=""))
        assert ask(far.port, "GET", "/version", headers=basic("near", "secret")).json == "1"
    finally:
        near.process.stop()
        far.process.stop()


def test_tls_from_the_client_through_both(lab, maker, tmp_path):
    """With a certificate of the client's own too."""
    chain = Chain(lab, maker, tmp_path, "rr+tcp", "rr+tcp")
    try:
        check_all(STEPS, run_steps("reference", lab, chain.near_port, STEPS, scheme="rrs+tcp", has_certificate=True))
    finally:
        chain.stop()


def test_the_far_gateway_dies(lab, tmp_path):
    """The near one says so and goes on; subscriptions and streams of its clients are back when the far one is."""
    chain = Chain(lab, "ours", tmp_path, "rr+tcp", "rrs+tcp")
    url = f"rr+ws://127.0.0.1:{chain.near_port}/devices/interop?service=interop"
    client = Background([sys.executable, PEERS / "subscriber.py", url], tmp_path / "subscriber.log")
    try:
        client.next_line()
        stream = Stream(chain.near_port, "/changed")
        chain.kill_far()
        assert stream.next()[2]["state"] == "connection_lost"
        chain.processes[-1].wait_until(lambda: "refused" in (chain.near_device().get("last_error") or ""))
        assert chain.near_device()["state"] == "offline"
        chain.restart_far()
        assert stream.next()[2]["state"] == "connected"
        client.write_line("tell")
        (told,) = json.loads(client.next_line(60))
        assert told == {"losses": 1, "value": 3}
        ask(chain.near_port, "POST", "/fire", {"count": 1})
        assert stream.next()[2]["value"] == 0
        stream.close()
        assert chain.near_device()["state"] == "online"
    finally:
        client.stop()
        chain.stop()


def test_a_device_that_is_lost_behind_the_far_gateway_is_lost_at_the_near_one(node, tmp_path):
    """Where both share it, too: the near one shows no value of before as one of now, and nothing as online."""
    far = Site(tmp_path, node)
    (tmp_path / "near").mkdir()
    try:
        near, port = start_gateway(tmp_path / "near", f"rr+tcp://127.0.0.1:{far.port}/?nodename=interop&service=plain",
                                   device={"mode": "shared"}, retry=RETRY)

        def state():
            return read_json(f"http://127.0.0.1:{port}/api/v1/devices")["devices"][0]["state"]

        def next_state():
            while not isinstance(said := stream.next()[2], dict) or "state" not in said:
                pass  # values
            return said["state"]

        def target(at):
            return http_api.ask(at, "GET", PLAIN + "/seen_target").status

        try:
            stream = http_api.Stream(port, PLAIN + "/state")
            assert target(port) == 200
            far.line.lead_to(free_port())
            far.line.cut()
            assert next_state() == "connection_lost"
            near.wait_until(lambda: state() == "offline")
            assert target(port) == target(far.port) != 200
            far.line.lead_to(port_of(far.url))
            assert next_state() == "connected"
            near.wait_until(lambda: state() == "online")
            assert target(port) == 200
            stream.close()
        finally:
            near.stop()
    finally:
        far.stop()


def test_gateways_that_share_each_other_are_offline(tmp_path):
    """Neither shows a device that is nowhere, and what they say of each other does not grow."""
    def device_of(port):
        return read_json(f"http://127.0.0.1:{port}/api/v1/devices")["devices"][0]

    ports, gateways = [free_port(), free_port()], []
    try:
        for port, other in zip(ports, reversed(ports)):
            (tmp_path / str(port)).mkdir()
            device = {"name": "arm", "url": f"rr+tcp://127.0.0.1:{other}/?nodename=arm&service=arm", "mode": "shared"}
            gateways.append(Gateway(tmp_path / str(port), {
                "listen": [f"127.0.0.1:{port}"], "devices": [device], "retry": RETRY, "timeouts": {"connect_ms": 500}}))
        for gateway, port in zip(gateways, ports):
            gateway.wait_for("client connected", 20)
            gateway.process.wait_until(lambda: device_of(port)["state"] == "offline")
            assert len(device_of(port)["last_error"]) < 1000
    finally:
        for gateway in gateways:
            gateway.process.stop()


@pytest.mark.parametrize("count", [1, 2], ids=["itself", "each other"])
@pytest.mark.parametrize("scheme", ["rr+tcp", "rr+ws"])
def test_a_circle(lab, tmp_path, scheme, count):
    """Gateways that have each other as a device, or one that has itself, say so; no connection goes round and round."""
    def device(port):
        path = "devices/interop" if scheme == "rr+ws" else ""
        return {"name": "interop", "url": f"{scheme}://127.0.0.1:{port}/{path}?service=interop"}

    folders = [tmp_path / str(number) for number in range(count)]
    for folder in folders:
        folder.mkdir()
    ports = [free_port() for _ in folders]
    gateways = []
    service, service_port = start_service("ours", lab, "good", tmp_path)
    try:
        for folder, port, to in zip(folders, ports, ports[1:] + ports[:1]):
            gateways.append(Gateway(folder, {"listen": [f"127.0.0.1:{port}"], "devices": [device(to)]}))
        gateways[-1].process.wait_until(lambda: any(
            "its URL leads back to this gateway" in event.get("error", "")
            for gateway in gateways for event in gateway.events() if event["event"] == "device offline"))
        for port in ports:
            answer = run_steps("reference", lab, port, scheme="rr+tcp", node="")
            assert "connect_error" in answer, answer
        # How often a connection went from hand to hand.
        assert sum(event["event"] == "client connected" for gateway in gateways for event in gateway.events()) < 20
        # One who is put right makes all right.
        gateways[0].write({**gateways[0].config, "devices": [
            {"name": "interop", "url": f"rr+tcp://127.0.0.1:{service_port}/?service=interop"}]})
        gateways[0].hang_up()
        for gateway, port in zip(gateways, ports):
            gateway.process.wait_until(  # now: it may have seemed so before the circle was noticed
                lambda at=f"http://127.0.0.1:{port}/api/v1/devices": read_json(at)["devices"][0]["state"] == "online")
            check_all(FUNCTIONS.steps, run_steps("reference", lab, port, scheme="rr+tcp", node=""))
    finally:
        for gateway in gateways:
            gateway.process.stop()
        service.stop()
