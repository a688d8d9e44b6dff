"""Shared devices: many clients, one session with the device. The clients here are those of the real package; what single
members do is test_interop.py's, whose scenarios all run through a shared device as well."""
import json
import pathlib
import signal
import sys
import time

import numpy
import pytest
import RobotRaconteur as RR

from clients import JS, run_program
from directions import PEERS
from load import Clients, running
from news import News
from processes import BUILD, Background, free_port, read_json, start_gateway
from scenarios import POSE
from shared_sites import RETRY, is_refused, port_of, start_arm, start_service
from tap import Tap
from values import Values

SERVICES = {"interop", "guarded", "open", "proven", "RobotRaconteurServiceIndex"}  # of the test service's node
GATEWAY_ID = "5c0ffee0-1111-4222-8333-944455556666"


@pytest.fixture
def site(tmp_path):
    """(gateway process, its port, URL of the device)"""
    service, url = start_service(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, node={"name": "lab.gateway", "id": GATEWAY_ID})
    yield gateway, port, url
    assert gateway.stop() == 0, gateway.description()
    service.stop()


def connections_to(port):
    """Established connections of this machine to a port, as the kernel lists them."""
    lines = pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]
    return sum(1 for line in lines if line.split()[2].endswith(f":{port:04X}") and line.split()[3] == "01")


def wire_news(connection):
    news = News()
    connection.WireValueChanged += lambda wire, value, time: news.add(list(value) if hasattr(value, "__len__") else value)
    return news


def test_many_clients_are_one_to_the_device(node, site):
    _, port, url = site
    roots = [node.ConnectService(f"rr+ws://127.0.0.1:{port}/devices/interop?service=interop")]
    before = connections_to(port_of(url))
    roots += [node.ConnectService(f"rr+ws://127.0.0.1:{port}/devices/interop?service=interop") for _ in range(7)]
    wires = [root.state.Connect() for root in roots]
    news = [wire_news(wire) for wire in wires]
    assert connections_to(port_of(url)) == before
    roots[0].publish_state([4.0])
    for each in news:
        each.wait_for(lambda value: value == [4.0])
    # Who comes late gets the newest value at once: after so long the device has not sent another. (A client of the
    # package takes messages side by side, and may miss a value that comes with the answer to its connect.)
    steps = [{"connect": "state"}, {"in_value": "state", "until": [4.0]}]
    late = run_program([BUILD / "test/interop/cpp/rr-test-client", f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"], steps)
    assert late["results"][1] == {"value": [4.0]}
    answer = read_json(f"http://127.0.0.1:{port}/api/v1/devices/interop/interop/version")
    assert answer == "1"
    assert connections_to(port_of(url)) == before
    assert read_json(f"http://127.0.0.1:{port}/api/v1/devices")["devices"][0]["mode"] == "shared"
    for root in roots:
        node.DisconnectService(root)


@pytest.mark.parametrize("way", ["rr+tcp://127.0.0.1:{}/?nodename=lab.gateway&", "rr+ws://127.0.0.1:{}/gateway?"])
def test_the_index_tells_of_shared_services(node, site, way):
    _, port, _ = site
    index = node.ConnectService(way.format(port) + "service=RobotRaconteurServiceIndex")
    services = {service.Name: service for service in index.GetLocalNodeServices().values()}
    assert set(services) == {*SERVICES, "gateway"}
    assert services["interop"].RootObjectType == "experimental.interop.Interop"
    url = services["interop"].ConnectionURL[1]
    assert GATEWAY_ID in url
    root = node.ConnectService(url)
    assert root.version == "1"
    assert node.GetServiceAttributes(root)["rrgate.mode"].data == "shared"
    routed = index.GetRoutedNodes()
    assert [each.NodeName for each in routed.values()] == ["interop"]
    behind = node.ConnectService(routed[0].ServiceIndexConnectionURL[0])
    names = {service.Name for service in behind.GetLocalNodeServices().values()}
    assert names == SERVICES
    for each in (index, root, behind):
        node.DisconnectService(each)


def test_the_gateway_is_a_service(node, site, tmp_path):
    gateway, port, _ = site
    gateway.wait_until(lambda: "session rests device=gateway service=gateway" in (tmp_path / "gateway.log").read_text())
    client = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop")
    root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=lab.gateway&service=gateway")
    (newest,) = root.statistics.PeekInValue()[0]
    assert newest.device == "interop" and newest.messages_to_device > 0, "not those of when the gateway began"
    devices = root.devices
    assert [(each.name, each.state, each.mode) for each in devices] == [("interop", "online", "shared")]
    assert root.find_device("interop").node_name == "interop.service"
    with pytest.raises(RR.KeyNotFoundException):
        root.find_device("nothing")
    wire_news(client.state.Connect())
    client.publish_state([1.0])
    statistics = News()
    connection = root.statistics.Connect()
    connection.WireValueChanged += lambda wire, value, time: statistics.add(value[0].device)
    statistics.wait_for(lambda device: device == "interop")
    (subscription,) = root.subscriptions
    assert (subscription.path, subscription.member, subscription.kind) == ("interop", "state", "wire")
    assert subscription.delivered >= 1 and subscription.conflated == 0
    assert 0 < subscription.age_p99 < 5
    changes = News()
    root.device_changed += lambda device: changes.add(("changed", device.name, device.state))
    root.device_removed += lambda name: changes.add(("removed", name))
    config = json.loads((tmp_path / "gateway.json").read_text())
    config["devices"].append({"name": "nobody", "url": "rr+tcp://127.0.0.1:9/"})
    (tmp_path / "gateway.json").write_text(json.dumps(config))
    changes.wait_for(lambda change: change == ("changed", "nobody", "offline"))
    config["devices"].pop()
    (tmp_path / "gateway.json").write_text(json.dumps(config))
    changes.wait_for(lambda change: change == ("removed", "nobody"))
    for each in (root, client):
        node.DisconnectService(each)


def test_each_value_of_a_wire_is_delivered_or_counted(node, site, tmp_path):
    """To more clients than are sent a value in one go, while values come faster than that."""
    _, port, _ = site
    count, values = 150, 100
    publisher = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop")
    url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"

    def publish():
        publisher.publish_state(numpy.zeros(3))

    def accounts():
        """Values of each client."""
        all_of_them = read_json(f"http://127.0.0.1:{port}/api/v1/devices/interop/subscriptions")["subscriptions"]
        return {each["client"]: each["delivered"] + each["conflated"] for each in all_of_them}

    def last_accounts():
        """Once nothing comes any more."""
        before = accounts()
        clients.process.wait_until(lambda: time.sleep(0.5) or before == accounts() or before.update(accounts()))
        return before

    with running(Clients(tmp_path, url, count)) as clients, running(Clients(tmp_path, url, count, name="leaving")) as leaving:
        clients.process.wait_until(lambda: publish() or len(accounts()) == 2 * count)
        assert clients.wait_until_ready()["ready"] == leaving.wait_until_ready()["ready"] == count
        before = last_accounts()
        for _ in range(values - 1):
            publish()
        leaving.process.process.kill()
        publish()  # to some who have gone, among them
        clients.process.wait_until(lambda: len(accounts()) == count)
        assert last_accounts() == {client: before[client] + values for client in accounts()}
        assert clients.finish()["lost"] == {}
    node.DisconnectService(publisher)


def ask_losses(client):
    client.write_line("tell")
    return json.loads(client.next_line())


def test_a_client_hears_of_its_losses(node, site, tmp_path):
    """In its own session: one that does not read, while the device publishes, hears what it has missed."""
    _, port, _ = site
    url = f"ws://127.0.0.1:{port}/devices/interop?service=interop"
    client = Background(["node", JS / "losses.mjs", url], tmp_path / "client.log")
    late = None
    try:
        client.next_line()
        publisher = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop")
        client.pause()

        def conflated():
            publisher.publish_state(numpy.zeros(100_000))
            subscriptions = read_json(f"http://127.0.0.1:{port}/api/v1/devices/interop/subscriptions")["subscriptions"]
            return sum(each["conflated"] for each in subscriptions)
        client.wait_until(lambda: conflated() >= 3)
        client.resume()
        told = ask_losses(client)
        assert told["wire"]["conflated"] >= 3 and told["wire"]["delivered"] >= 1 and told["wire"]["dropped"] == 0, told
        assert told["wire"]["ageP99"] >= told["wire"]["ageP50"] > 0
        assert told["pipe"]["conflated"] == told["pipe"]["dropped"] == 0
        late = Background(["node", JS / "losses.mjs", url], tmp_path / "late.log")
        late.next_line()
        assert ask_losses(late)["wire"]["conflated"] == 0  # to each its own
        node.DisconnectService(publisher)
    finally:
        client.stop()
        if late:
            late.stop()


@pytest.mark.parametrize("mode", ["direct", "relayed"])
def test_a_device_of_the_package_keeps_no_account(tmp_path, mode):
    service = Background([sys.executable, pathlib.Path(__file__).parent / "peers" / "service.py"], tmp_path / "service.log")
    url = json.loads(service.next_line())["url"].replace("rr+tcp:", "ws:")
    gateway = client = None
    try:
        if mode == "relayed":
            gateway, port = start_gateway(tmp_path, url.replace("ws:", "rr+tcp:"))
            url = f"ws://127.0.0.1:{port}/devices/interop?service=interop"
        client = Background(["node", JS / "losses.mjs", url], tmp_path / "client.log")
        client.next_line()
        assert ask_losses(client) == {"wire": None, "pipe": None}
    finally:
        for each in (client, gateway, service):
            if each:
                each.stop()


def test_clients_stay_when_the_device_goes(node, tmp_path):
    service, url = start_service(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, retry={"min_ms": 50, "max_ms": 200})
    try:
        root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop")
        state = wire_news(root.state.Connect())
        poses = News()
        pipe = root.poses.Connect(-1)

        def received(endpoint):
            while endpoint.Available:
                poses.add(endpoint.ReceivePacket().px)
        pipe.PacketReceivedEvent += received
        root.publish_state([1.0])
        state.wait_for(lambda value: value == [1.0])
        service.stop()
        with pytest.raises(RR.ConnectionException, match="connection_lost"):
            while True:
                root.version
        service, _ = start_service(tmp_path, f"--robotraconteur-tcp-port={port_of(url)}")

        def is_back():
            try:
                return root.version == "1"
            except RR.ConnectionException:
                return False
        gateway.wait_until(is_back)
        root.publish_state([2.0])
        state.wait_for(lambda value: value == [2.0])
        root.publish_poses(Values(root).build(POSE), 2)
        poses.wait_for(lambda px: px == 1.0)
        node.DisconnectService(root)
    finally:
        gateway.stop()
        service.stop()


def test_who_has_sent_on_a_pipe_hears_that_the_device_went(node, tmp_path):
    """Packets may have been lost on their way; an endpoint on which nothing was sent goes on."""
    service, url = start_service(tmp_path)
    line = Tap(port_of(url))
    gateway, port = start_gateway(tmp_path, f"rr+tcp://127.0.0.1:{line.port}/?service=interop", device={"mode": "shared"},
                                  retry={"min_ms": 50, "max_ms": 200})
    try:
        root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop")
        doubled, closed = [News(), News()], News()
        sent, silent = root.doubled.Connect(-1), root.doubled.Connect(-1)
        for endpoint, news in zip((sent, silent), doubled, strict=True):
            endpoint.PacketReceivedEvent += lambda endpoint, news=news: news.add(endpoint.ReceivePacket())
            endpoint.PipeEndpointClosedCallback = lambda endpoint: closed.add(endpoint.Index)
        sent.SendPacket(1.0)
        doubled[0].wait_for(lambda value: value == 2.0)
        line.cut()
        closed.wait_for(lambda index: index == sent.Index)

        def is_back():
            try:
                return root.version == "1"
            except RR.ConnectionException:
                return False
        gateway.wait_until(is_back)
        silent.SendPacket(3.0)
        doubled[1].wait_for(lambda value: value == 6.0)
        node.DisconnectService(root)
    finally:
        gateway.stop()
        line.close()
        service.stop()


def test_sessions_may_end_by_themselves_when_the_gateway_stops(node, tmp_path):
    service, url = start_service(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, timeouts={"drain_ms": 60_000})
    try:
        at_device = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop")
        at_gateway = node.ConnectService(f"rr+ws://127.0.0.1:{port}/?nodename=rrgate&service=interop")
        state = wire_news(at_device.state.Connect())
        gateway.process.send_signal(signal.SIGTERM)
        gateway.wait_until(lambda: "stopping" in (tmp_path / "gateway.log").read_text())
        assert read_json(f"http://127.0.0.1:{port}/readyz") is None
        at_gateway.publish_state([6.0])
        state.wait_for(lambda value: value == [6.0])
        assert at_device.add(1.0, 2.0) == 3.0
        node.DisconnectService(at_gateway)
        assert at_device.version == "1"
        node.DisconnectService(at_device)
        assert gateway.process.wait(10) == 0
    finally:
        gateway.stop()
        service.stop()


@pytest.mark.parametrize("mode", ["relay", "shared"])
@pytest.mark.parametrize("scheme", ["rr+tcp", "rr+ws"])
def test_a_client_too_many_hears_why(node, tmp_path, mode, scheme):
    service, url = start_service(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": mode, "max_clients": 1})
    where = f"{scheme}://127.0.0.1:{port}/" + ("devices/interop?" if scheme == "rr+ws" else "?")
    own_url = where + ("nodename=interop&" if mode == "shared" else "") + "service=interop"
    try:
        root = node.ConnectService(own_url)
        # The reference keeps what the gateway says before there is a session to itself.
        with pytest.raises(RR.ConnectionException, match="all the clients it may have" if mode == "shared" else None):
            node.ConnectService(own_url)
        assert root.version == "1"
        node.DisconnectService(root)
    finally:
        gateway.stop()
        service.stop()


def test_who_comes_while_the_device_refuses_the_gateway_hears_why(node, tmp_path):
    service, url = start_service(tmp_path)
    login = {"username": "alice", "password": "hunter2"}
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared", "login": login}, retry=RETRY)
    try:
        for query in ("nodename=interop&service=guarded", "service=guarded"):
            with pytest.raises(RR.ConnectionException, match="'guarded' of device 'interop': .*Authentication Failed"):
                node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?{query}")
    finally:
        gateway.stop()
        service.stop()


def test_a_device_without_a_service_index(node, tmp_path):
    """What its URL names is a service too, and is so again when the device comes back."""
    service, url = start_arm(tmp_path)
    index, nobody = b"RobotRaconteurServiceIndex", b"RobotRaconteurServiceNobody"[:26]
    tap = Tap(port_of(url), change=lambda data: data.replace(index, nobody))
    gateway, port = start_gateway(tmp_path, f"rr+tcp://127.0.0.1:{tap.port}/?service=plain", device={"mode": "shared"}, retry=RETRY)
    try:
        root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=plain")
        for is_last in (False, True):
            assert root.status == 0
            (device,) = read_json(f"http://127.0.0.1:{port}/api/v1/devices")["devices"]
            assert [each["name"] for each in device["services"]] == ["plain"]
            assert read_json(f"http://127.0.0.1:{port}/api/v1/devices/interop/plain/status") == 0
            if is_last:
                break
            service.stop()
            gateway.wait_until(lambda: is_refused(RR.ConnectionException, lambda: root.status))
            service, url = start_arm(tmp_path)
            tap.lead_to(port_of(url))
            gateway.wait_until(lambda: not is_refused(RR.ConnectionException, lambda: root.status))
        node.DisconnectService(root)
    finally:
        gateway.stop()
        tap.close()
        service.stop()


@pytest.mark.parametrize("answer", ["first", "all"])
def test_who_answers_callbacks(node, tmp_path, answer):
    service, url = start_service(tmp_path)
    device = {"mode": "shared", "callbacks": [{"member": "interop.as*", "answer": answer}]}
    gateway, port = start_gateway(tmp_path, url, device=device)
    try:
        own_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"
        first, second = node.ConnectService(own_url), node.ConnectService(own_url)
        asked = News()
        for number, root in enumerate((first, second)):
            def reply(question, number=number):
                asked.add(number)
                return float(number + 10)
            root.ask.Function = reply
        second.start_ask("how many?")
        asked.wait_for(lambda number: number == 0)
        if answer == "all":
            asked.wait_for(lambda number: number == 1)
        gateway.wait_until(lambda: second.answered != 0)
        assert second.answered in ((10.0,) if answer == "first" else (10.0, 11.0))
        node.DisconnectService(first)
        node.DisconnectService(second)
    finally:
        gateway.stop()
        service.stop()


def test_an_endpoint_hears_nothing_that_the_device_still_sends_to_one_that_was_closed(node, tmp_path):
    """A device of the package sends it to the next endpoint of the same index."""
    port = free_port()
    device = Background([sys.executable, PEERS / "chaos_device.py", tmp_path / "journal", f"--robotraconteur-tcp-port={port}"],
                        tmp_path / "device.log")
    gateway, port = start_gateway(tmp_path, json.loads(device.next_line())["url"], device={"mode": "shared"})
    root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=chaos")
    mine = [1.0, 2.0, 3.0, 4.0, 5.0]
    for _ in range(40):
        left = root.echo.Connect(-1)
        for number in range(100):
            left.AsyncSendPacket(1000.0 + number, lambda number, error: None)
        left.AsyncClose(lambda error: None, 5)
        endpoint = root.echo.Connect(-1)
        for number in mine:
            endpoint.SendPacket(number)
        assert [endpoint.ReceivePacketWait(5000) for _ in mine] == mine
        endpoint.Close()
    node.DisconnectService(root)
    assert gateway.stop() == 0
    device.stop()
