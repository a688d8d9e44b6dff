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
from gateways import rrgate
from http_api import ask
from load import Clients, running
from news import News
from processes import BUILD, Background, read_json, start_gateway
from scenarios import POSE
from shared_sites import port_of, start_service
from tap import Tap
from users import PASSWORDS, RULES, basic, make_users
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
    before = connections_to(port_of(url))
    roots = [node.ConnectService(f"rr+ws://127.0.0.1:{port}/devices/interop?service=interop") for _ in range(8)]
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


def test_the_index_tells_of_shared_services(node, site):
    _, port, _ = site
    index = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=lab.gateway&service=RobotRaconteurServiceIndex")
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
    root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=lab.gateway&service=gateway")
    devices = root.devices
    assert [(each.name, each.state, each.mode) for each in devices] == [("interop", "online", "shared")]
    assert root.find_device("interop").node_name == "interop.service"
    with pytest.raises(RR.KeyNotFoundException):
        root.find_device("nothing")
    client = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop")
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


def test_a_device_without_a_service_index(node, tmp_path):
    """What its URL names is a service too."""
    service, url = start_service(tmp_path)
    index, nobody = b"RobotRaconteurServiceIndex", b"RobotRaconteurServiceNobody"[:26]
    tap = Tap(port_of(url), change=lambda data: data.replace(index, nobody))
    gateway, port = start_gateway(tmp_path, f"rr+tcp://127.0.0.1:{tap.port}/?service=interop", device={"mode": "shared"})
    try:
        root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop")
        assert root.version == "1"
        (device,) = read_json(f"http://127.0.0.1:{port}/api/v1/devices")["devices"]
        assert [each["name"] for each in device["services"]] == ["interop"]
        assert read_json(f"http://127.0.0.1:{port}/api/v1/devices/interop/interop/version") == "1"
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


def audited(gateway, folder, is_there):
    """What others than the audit log itself are recorded with, once it is there."""
    found = []

    def read():
        lines = map(json.loads, (folder / "audit").read_text().splitlines())
        found[:] = [line for line in lines if line["event"] not in ("started", "stopped")]
        return found and is_there(found)

    gateway.wait_until(read)
    return found


def test_rights_member_by_member(node, tmp_path):
    """Users of the gateway in a shared session, each verb against what the rules say."""
    service, url = start_service(tmp_path)
    make_users(tmp_path)

    def is_up():  # the list of devices is not for everybody
        return "device online device=interop" in (tmp_path / "gateway.log").read_text()

    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, is_up=is_up,
                                  access={"users_file": "users", "rules": RULES, "audit_file": "audit"})
    shared_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"

    def write_memory(root):
        root.m_numbers.Write(0, numpy.array([1.0]), 0, 1)

    attempts = {
        "read": lambda root: root.p_double,
        "write": lambda root: setattr(root, "p_double", 2.5),
        "call": lambda root: root.add(1.0, 2.0),
        "other write": lambda root: setattr(root, "p_int32", 1),
        "other call": lambda root: root.nothing(),
        "memory": write_memory,
        "peek": lambda root: root.both.PeekInValue(),
        "poke": lambda root: root.both.PokeOutValue(1.0),
        "subscribe": lambda root: root.state.Connect().Close(),
        "pipe": lambda root: root.greetings.Connect(-1).Close(),
        "below": lambda root: root.get_head().size,
        "below call": lambda root: root.get_head().identify(),
        "lock": lambda root: node.RequestObjectLock(root, RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK),
    }
    looks = {"read", "peek", "subscribe", "pipe", "below"}
    may = {"vera": looks, "alice": looks | {"write", "call"}, "root": set(attempts)}
    try:
        with pytest.raises(RR.AuthenticationException):
            node.ConnectService(shared_url, "alice", {"password": RR.VarValue("wrong", "string")})
        for user, allowed in may.items():
            root = node.ConnectService(shared_url, user, {"password": RR.VarValue(PASSWORDS[user], "string")})
            for what, attempt in attempts.items():
                try:
                    attempt(root)
                    denied = False
                except RR.PermissionDeniedException as error:
                    assert "may not" in str(error), str(error)
                    denied = True
                except RR.RobotRaconteurException:  # the device's own affair: it was asked
                    denied = False
                assert denied == (what not in allowed), (user, what)
            node.DisconnectService(root)
        lines = audited(gateway, tmp_path, lambda lines: any(line["event"] == "login" and line["user"] == "root" for line in lines))
        assert any(line.get("user") == "vera" and line.get("member") == "p_double" for line in lines), lines[-5:]
        logins = [(line["event"], line["user"]) for line in lines if line["event"].startswith("login")]
        assert logins == [("login_failed", "alice"), *(("login", user) for user in may)]
        assert all(line["client"].startswith("127.0.0.1:") for line in lines)
    finally:
        gateway.stop()
        service.stop()


def test_a_login_that_the_device_judges_gives_no_rights_of_the_gateways_users(node, tmp_path):
    """Where the gateway has users, but none with passwords, a login is the device's; alice there is nobody here."""
    service, url = start_service(tmp_path)
    (tmp_path / "tokens").touch()
    rules = [{"roles": ["guest"], "may": ["read", "call"]}, {"roles": ["*", "operator"], "may": ["write"]}]
    access = {"tokens_file": "tokens", "anonymous_role": "guest", "rules": rules, "audit_file": "audit",
              "grants": [{"users": ["alice"], "roles": ["operator"]}]}
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, access=access)
    try:
        root = node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=guarded", "alice",
                                   {"password": RR.VarValue("secret", "string")})
        assert root.who() == "alice"
        with pytest.raises(RR.PermissionDeniedException, match="'alice' of the device, who is no user of the gateway, may not write"):
            root.level = 2.0
        node.DisconnectService(root)
        lines = audited(gateway, tmp_path, lambda lines: lines[-1]["event"] == "refused")
        (refused,) = (line for line in lines if line["event"] == "refused")
        assert (refused["proof"], refused["device_user"]) == ("none", "alice")
        (login,) = (line for line in lines if line["event"] == "login")
        assert (login["device_user"], login["device"], login["service"], login.get("user")) == ("alice", "interop", "guarded", None)
        assert login["client"].startswith("127.0.0.1:")
        with pytest.raises(RR.AuthenticationException):
            node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=guarded", *password_of("alice", "wrong"))
        lines = audited(gateway, tmp_path, lambda lines: lines[-1]["event"] == "login_failed")
        assert (lines[-1]["event"], lines[-1]["device_user"]) == ("login_failed", "alice")
    finally:
        gateway.stop()
        service.stop()


def test_users_that_a_reload_brings_are_the_gateways_at_services_that_are_open(node, tmp_path):
    service, url = start_service(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"})

    def connect(service, user, password):
        return node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service={service}", user,
                                   {"password": RR.VarValue(password, "string")})

    try:
        before = connect("guarded", "alice", "secret")  # a user of the device
        assert before.who() == "alice"
        make_users(tmp_path)
        config = json.loads((tmp_path / "gateway.json").read_text())
        (tmp_path / "gateway.json").write_text(json.dumps({**config, "access": {"users_file": "users", "rules": RULES}}))
        gateway.wait_until(lambda: "configuration read anew" in (tmp_path / "gateway.log").read_text())
        with pytest.raises(RR.PermissionDeniedException):
            before.who()
        for service_name in ("guarded", "interop"):
            with pytest.raises(RR.AuthenticationException):
                connect(service_name, "alice", "secret")
        root = connect("interop", "alice", PASSWORDS["alice"])
        assert root.version == "1"
        with pytest.raises(RR.PermissionDeniedException, match="operator"):
            root.nothing()
        for each in (before, root):
            node.DisconnectService(each)
    finally:
        gateway.stop()
        service.stop()


def password_of(user, password=None):
    return user, {"password": RR.VarValue(password or PASSWORDS[user], "string")}


def test_who_may_do_nothing_gets_to_no_service(node, tmp_path):
    """Refused as he connects: he takes no place, is asked nothing, and is told of nothing."""
    service, url = start_service(tmp_path)
    make_users(tmp_path)
    rrgate("passwd", tmp_path / "users", "nora", "--roles", "none", given="nothing\n")
    device = {"mode": "shared", "max_clients": 1, "callbacks": [{"member": "interop.ask", "answer": "first"}]}
    access = {"users_file": "users", "rules": RULES, "audit_file": "audit"}
    gateway, port = start_gateway(tmp_path, url, device=device, access=access, node={"name": "lab.gateway"},
                                  is_up=lambda: "session open device=interop service=interop" in (tmp_path / "gateway.log").read_text())
    of_device, of_gateway = (f"rr+tcp://127.0.0.1:{port}/?nodename={name}&service=" for name in ("interop", "lab.gateway"))
    strangers = []
    try:
        for where in (of_device, of_gateway):
            for name in ("interop", "guarded", "nothing"):
                with pytest.raises(RR.AuthenticationException, match=f"who is not logged in may not use service '{name}'"):
                    node.ConnectService(where + name)
                with pytest.raises(RR.AuthenticationException, match="Authentication Failed"):
                    node.ConnectService(where + name, *password_of("vera", "wrong"))
            with pytest.raises(RR.PermissionDeniedException, match="'nora' .* may not"):
                node.ConnectService(where + "interop", *password_of("nora", "nothing"))
            index = node.ConnectService(where + "RobotRaconteurServiceIndex")
            strangers.append(index)
            assert {each.Name for each in index.GetLocalNodeServices().values()} == {"RobotRaconteurServiceIndex"}
            assert index.GetRoutedNodes() == {} and index.GetDetectedNodes() == {}
        root = node.ConnectService(of_device + "interop", *password_of("root"))  # on the one seat there is
        root.ask.Function = lambda question: 2.0
        root.start_ask("may it?")
        gateway.wait_until(lambda: root.answered == 2.0)
        with pytest.raises(RR.ConnectionException, match="all the clients it may have"):
            node.ConnectService(of_gateway + "interop", *password_of("vera"))
        node.DisconnectService(root)
        audited(gateway, tmp_path, lambda lines: any((line["event"], line.get("device"), line.get("user")) == ("refused", "interop", "nora")
                                                     for line in lines))
        for each in strangers:
            node.DisconnectService(each)
    finally:
        gateway.stop()
        service.stop()


def test_a_stranger_wakes_no_session_that_rests(node, tmp_path):
    """Nor does his wrong password; a login that is right does, and finds what it needs."""
    service, url = start_service(tmp_path)
    make_users(tmp_path)
    log = tmp_path / "gateway.log"
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, access={"users_file": "users", "rules": RULES},
                                  timeouts={"unused_session_ms": 300},
                                  is_up=lambda: "session rests device=interop service=interop" in log.read_text())
    shared_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"
    try:
        opened = log.read_text().count("session open device=interop service=interop")
        for login in ((), password_of("vera", "wrong")):
            with pytest.raises(RR.AuthenticationException):
                node.ConnectService(shared_url, *login)
        assert log.read_text().count("session open device=interop service=interop") == opened
        vera = node.ConnectService(shared_url, *password_of("vera"))
        assert vera.version == "1"
        assert log.read_text().count("session open device=interop service=interop") == opened + 1
        node.DisconnectService(vera)
    finally:
        gateway.stop()
        service.stop()


def test_a_user_who_is_deleted_has_no_session_any_more(node, tmp_path):
    service, url = start_service(tmp_path)
    make_users(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, access={"users_file": "users", "rules": RULES},
                                  is_up=lambda: "session open device=interop service=interop" in (tmp_path / "gateway.log").read_text())
    shared_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"
    try:
        sessions = {user: node.ConnectService(shared_url, *password_of(user)) for user in ("vera", "root")}
        assert all(root.version == "1" for root in sessions.values())
        # Meanwhile: where from another client comes is for those who manage the gateway.
        wire = sessions["vera"].state.Connect()
        clients = {}
        for user in ("root", "alice"):
            answer = ask(port, "GET", "/api/v1/devices/interop/subscriptions", headers=basic(user)).json
            clients[user] = [each["client"] for each in answer["subscriptions"]]
        assert clients["alice"] == [None] and clients["root"][0].startswith("127.0.0.1:"), clients
        wire.Close()
        rrgate("passwd", tmp_path / "users", "vera", "--delete")
        began = time.monotonic()
        with pytest.raises(RR.RobotRaconteurException):
            while time.monotonic() - began < 10:
                sessions["vera"].version
        assert time.monotonic() - began < 1.5
        assert sessions["root"].version == "1"
        node.DisconnectService(sessions["root"])
    finally:
        gateway.stop()
        service.stop()


def test_wrong_passwords_of_one_user_keep_out_no_other(node, tmp_path):
    service, url = start_service(tmp_path)
    make_users(tmp_path)
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, access={"users_file": "users", "rules": RULES},
                                  is_up=lambda: "session open device=interop service=interop" in (tmp_path / "gateway.log").read_text())
    shared_url = f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop"
    try:
        for number in range(65):
            with pytest.raises(RR.AuthenticationException):
                node.ConnectService(shared_url, *password_of("alice", f"guess {number}"))
        root = node.ConnectService(shared_url, *password_of("root"))
        assert root.version == "1"
        node.DisconnectService(root)
    finally:
        gateway.stop()
        service.stop()


def test_the_audit_log_has_the_first_packet_of_each_wire_and_pipe(node, tmp_path):
    service, url = start_service(tmp_path)
    make_users(tmp_path)
    access = {"users_file": "users", "rules": RULES, "audit_file": "audit"}
    gateway, port = start_gateway(tmp_path, url, device={"mode": "shared"}, access=access,
                                  is_up=lambda: "session open device=interop service=interop" in (tmp_path / "gateway.log").read_text())

    def recorded():
        lines = [json.loads(line) for line in (tmp_path / "audit").read_text().splitlines()]
        return [(line["event"], line["user"], line["member"]) for line in lines if line.get("verb") == "write"]

    try:
        root, vera = (node.ConnectService(f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop", *password_of(user))
                      for user in ("root", "vera"))
        wire, pipe, hers = root.both.Connect(), root.greetings.Connect(-1), vera.both.Connect()
        for number in range(5):
            wire.OutValue = float(number)
            pipe.SendPacket(f"hello {number}")
            hers.OutValue = -1.0
        gateway.wait_until(lambda: len(recorded()) == 3)
        gateway.wait_until(lambda: root.both.PeekOutValue()[0] == 4.0)
        assert sorted(recorded()) == [("refused", "vera", "both"), ("write", "root", "both"), ("write", "root", "greetings")]
        for each in (root, vera):
            node.DisconnectService(each)
    finally:
        gateway.stop()
        service.stop()
