"""Three gateways behind a proxy with the configurations of gateway-config/cluster/: each device has one of them."""
import contextlib
import json
import re
import signal
import sys

import pytest
from websockets.sync.client import connect

from clients import run_and_check
from directions import PEERS
from http_api import ask, fetch, upgrade_status
from processes import Background, read_json, start_gateway
from reverse_proxies import ReverseProxy
from scenarios import FUNCTIONS
from users import RULES, basic, bearer, make_users

DEVICES = [f"robot{number}" for number in range(10)]
PROXIES = {"nginx": "../cluster/nginx.conf", "haproxy": "../cluster/haproxy.cfg"}


@pytest.fixture(scope="module")
def device_url(tmp_path_factory):
    service = Background([sys.executable, PEERS / "service.py"], tmp_path_factory.mktemp("device") / "service.log")
    yield json.loads(service.next_line())["url"]
    service.stop()


class Cluster:
    """Gateways that all know the same devices, and the proxy before them."""

    def __init__(self, proxy, device_url, folder, **config):
        self._folder, self._device_url, self._config = folder, device_url, config
        self.gateways = {}  # {number: (process, port)}
        self.ports = {}
        try:
            for number in range(3):
                (folder / str(number)).mkdir()
                self.start(number)
            ports = {8091 + number: port for number, port in self.ports.items()}
            self.proxy = ReverseProxy(proxy, PROXIES[proxy], folder, ports=ports)
        except BaseException:
            self.stop_gateways()
            raise

    def start(self, number):
        folder = self._folder / str(number)
        devices = [{"name": name, "url": self._device_url} for name in DEVICES]
        self.gateways[number], self.ports[number] = start_gateway(
            folder, self._device_url, port=self.ports.get(number), devices=devices, trusted_proxies=["127.0.0.1"],
            **self._config)

    def kill(self, number):
        process = self.gateways.pop(number)
        process.process.send_signal(signal.SIGKILL)
        process.stop()

    def seen_by(self, number):
        """Devices whose clients have come to this gateway since it started, as its log has it."""
        log = (self._folder / str(number) / "gateway.log").read_text()
        return set(re.findall(r"client connected .*device=(\S+)", log))

    def sessions_of(self, number):
        """Devices that this gateway has sessions with now."""
        devices = read_json(f"http://127.0.0.1:{self.ports[number]}/api/v1/devices")["devices"]
        return {device["name"] for device in devices if device["clients"] > 0}

    def url(self, name, scheme="ws"):
        return f"{scheme}://127.0.0.1:{self.proxy.root}/devices/{name}?service=interop"

    def stop_gateways(self):
        for process in self.gateways.values():
            process.stop()

    def stop(self):
        self.proxy.stop()
        self.stop_gateways()


@pytest.fixture(params=list(PROXIES))
def cluster(request, device_url, tmp_path):
    running = Cluster(request.param, device_url, tmp_path)
    yield running
    running.stop()


def owners(cluster, devices_of):
    """{device: number of its gateway}; fails where a device has more than one."""
    found = {}
    for number in cluster.gateways:
        for device in devices_of(number):
            assert found.setdefault(device, number) == number, f"{device} is at {found[device]} and {number}"
    return found


def read_property(cluster, name, address="127.0.0.2"):
    status, _, body = fetch(cluster.proxy.root, f"/api/v1/devices/{name}/interop/version", address=address)
    assert (status, json.loads(body)) == (200, "1"), body


def test_each_device_has_one_gateway(cluster):
    """Whoever comes, and by whichever way: the reference by WebSocket, others by HTTP."""
    for name in DEVICES[:4]:
        run_and_check("reference", cluster.url(name), FUNCTIONS.steps)
        run_and_check("reference", cluster.url(name), FUNCTIONS.steps[:1])
    by_websocket = owners(cluster, cluster.seen_by)
    assert set(by_websocket) == set(DEVICES[:4])
    for name in DEVICES:
        for address in ("127.0.0.2", "127.0.0.3", "127.0.0.4"):
            read_property(cluster, name, address)
            read_property(cluster, f"%{ord(name[0]):02x}{name[1:]}", address)  # the same name: its letters may be encoded
    by_http = owners(cluster, cluster.sessions_of)
    assert set(by_http) == set(DEVICES)
    assert by_websocket.items() <= by_http.items()
    assert len(set(by_http.values())) > 1
    assert len(json.loads(fetch(cluster.proxy.root, "/api/v1/devices")[2])["devices"]) == len(DEVICES)
    assert fetch(cluster.proxy.root, "/metrics")[0] == 403


@pytest.mark.parametrize("proxy", list(PROXIES))
def test_a_page_is_a_device_of_the_gateway_that_its_clients_come_to(proxy, device_url, tmp_path):
    cluster = Cluster(proxy, device_url, tmp_path, serve={}, timeouts={"connect_ms": 60000})
    pages = [f"page{number}" for number in range(8)]
    try:
        with contextlib.ExitStack() as open_pages:
            for name in pages:
                assert fetch(cluster.proxy.root, f"/api/v1/devices/{name}/Phone")[0] == 404
                url = f"ws://127.0.0.1:{cluster.proxy.root}/serve/{name}"
                page = open_pages.enter_context(connect(url, subprotocols=["rrgate.serve.v1"]))
                while json.loads(page.recv(10)) != {"served": name}:  # it is asked for connections too
                    pass
            for number in range(2, 5):  # 503: the page opens no connection
                found = {name: fetch(cluster.proxy.root, f"/api/v1/devices/{name}/Phone", address=f"127.0.0.{number}")[0]
                         for name in pages}
                assert found == dict.fromkeys(pages, 503)
    finally:
        cluster.stop()


def test_a_gateway_dies(cluster, tmp_path):
    """Its devices go to others, and clients of the reference are back by themselves; all other sessions stay."""
    client = subscribe_to_all(cluster, tmp_path)
    try:
        before = owners(cluster, cluster.sessions_of)
        assert set(before) == set(DEVICES)
        dead = before[DEVICES[0]]
        cluster.kill(dead)
        client.write_line("tell")
        told = dict(zip(DEVICES, json.loads(client.next_line(60))))
        assert {name: device["value"] for name, device in told.items()} == dict.fromkeys(DEVICES, 3)
        assert {name for name, device in told.items() if device["losses"]} == {
            name for name, number in before.items() if number == dead}
        for name in DEVICES:
            read_property(cluster, name)
        after = owners(cluster, cluster.sessions_of)
        assert {name: after[name] for name in DEVICES if before[name] != dead} == {
            name: number for name, number in before.items() if number != dead}

        # Back again, it gets its devices, one new client after the other.
        cluster.start(dead)
        cluster.gateways[dead].wait_until(lambda: comes_to(cluster, DEVICES[0], dead))
        client.stop()
        client = subscribe_to_all(cluster, tmp_path)
        assert cluster.seen_by(dead) == {name for name, number in before.items() if number == dead}
    finally:
        client.stop()


@pytest.mark.parametrize("proxy", list(PROXIES))
def test_who_may_is_known_at_all_gateways(proxy, device_url, tmp_path):
    """A ticket of one gateway is taken by all; who asks for access and who decides need not come to the same one."""
    make_users(tmp_path)
    (tmp_path / "tokens").touch()
    (tmp_path / "ticket.key").write_bytes(bytes(range(32)))
    access = {"users_file": str(tmp_path / "users"), "tokens_file": str(tmp_path / "tokens"),
              "ticket_key_file": str(tmp_path / "ticket.key"), "rules": RULES, "anonymous_role": "viewer"}
    cluster = Cluster(proxy, device_url, tmp_path, access=access)
    try:
        port = cluster.proxy.root
        for name in DEVICES:
            ticket = ask(port, "POST", "/api/v1/tickets", headers=basic("root")).json["ticket"]
            assert upgrade_status(port, f"/devices/{name}?ticket={ticket}") == 101, name
            assert upgrade_status(port, f"/devices/{name}?ticket={ticket}") == 401, "not just once"
            assert upgrade_status(port, f"/devices/{name}?ticket=x{ticket}") == 401
        asked = ask(port, "POST", "/api/v1/access/requests", {"name": "tablet"}, address="127.0.0.2").json
        requests = f"/api/v1/access/requests/{asked['id']}"
        for number in range(3, 7):
            listed = ask(port, "GET", "/api/v1/access/requests", headers=basic("root"), address=f"127.0.0.{number}").json
            assert [each["id"] for each in listed["requests"]] == [asked["id"]]
        assert ask(port, "POST", requests + "/approve", {"roles": ["operator"]}, basic("root"), address="127.0.0.7").status == 200
        token = ask(port, "POST", requests + "/claim", {"secret": asked["secret"]}, address="127.0.0.8").json["token"]
        for number, gateway_port in cluster.ports.items():
            cluster.gateways[number].wait_until(
                lambda: ask(gateway_port, "GET", "/api/v1/access", headers=bearer(token)).json.get("user") == "tablet")
    finally:
        cluster.stop()


def subscribe_to_all(cluster, folder):
    """The reference with a subscription to each device, when all are connected."""
    client = Background([sys.executable, PEERS / "subscriber.py", *(cluster.url(name, "rr+ws") for name in DEVICES)],
                        folder / "subscriber.log")
    try:
        client.next_line()
    except BaseException:
        client.stop()
        raise
    return client


def comes_to(cluster, name, number):
    read_property(cluster, name)
    return name in cluster.sessions_of(number)
