"""Nodes that find one another over IPv6 link-local multicast: ours and the reference's, each on a machine of its own."""
import json
import os
import socket
import struct
import time

import pytest

from found_nodes import FIND_DEADLINE, OURS, THEIRS, TYPE, Watch
from network import Network, run
from processes import BUILD, Background

REFERENCE_DEADLINE = 20.0  # seconds: it looks at a node that it has heard of when its own time has come
PORT = 48653  # of discovery
GROUPS = ("ff01::ba86", "ff02::ba86")
IDS = [f"1111111{number}-0000-4000-8000-000000000000" for number in range(8)]


@pytest.fixture(scope="module")
def network():
    made = Network(4)
    yield made
    made.close()


@pytest.fixture
def start(network, tmp_path):
    """start(host, *command): a background process there, ended with the test."""
    running = []

    def start_process(host, *command):
        running.append(Background(network.on(host, *command), tmp_path / f"{len(running)}.log"))
        return running[-1]

    yield start_process
    for process in running:
        process.stop()


def search(network, host, *command):
    done = run(*network.on(host, *command))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.strip().splitlines()[-1])


def serve(start, implementation, host, name, node_id, port=0, *more):
    command = [OURS] if implementation == "ours" else THEIRS
    process = start(host, *command, "serve", name, node_id, str(port), *more)
    process.next_line()
    return process


def test_our_node_is_found_by_the_reference(network, start):
    serve(start, "ours", 0, "ours.node", IDS[0])
    assert IDS[0] in search(network, 1, *THEIRS, "detected")
    (found,) = search(network, 1, *THEIRS, "find-type", TYPE)
    assert (found["node"], found["name"]) == ("ours.node", "thing")
    assert found["url"][0].startswith("rr+tcp://[fe80::") and "%" not in found["url"][0]


@pytest.mark.parametrize("implementation", ["ours", "theirs"])
def test_nodes_are_found_by_ours(network, start, implementation):
    watch = Watch(start(0, OURS, "watch"))
    serve(start, implementation, 1, "a.node", IDS[1])
    event = watch.wait_for(lambda event: event["id"] == IDS[1])
    assert (event["event"], event["name"]) == ("found", "a.node")
    assert event["urls"][0].startswith("rr+tcp://[fe80::") and "%eth0]" in event["urls"][0]
    assert len(event["nonce"]) == 16
    # Without its zone the address is tried on every interface.
    bare = event["urls"][0].replace("%eth0", "").replace("RobotRaconteurServiceIndex", "thing")
    assert search(network, 0, OURS, "call", bare) == {"one": 1}
    # One that is there already is asked for.
    late = Watch(start(2, OURS, "watch"))
    late.wait_for(lambda event: event["id"] == IDS[1])
    (service,) = search(network, 2, OURS, "find-type", TYPE)["found"]
    assert (service["node"], service["name"]) == ("a.node", "thing")
    (node,) = search(network, 2, OURS, "find-name", "a.node")["found"]
    assert node["id"] == IDS[1]


def test_nodes_are_found_by_ipv4_broadcast(network, start):
    watch = Watch(start(0, OURS, "watch", "ipv4"))
    serve(start, "theirs", 1, "their.node", IDS[1], 0, "ipv4")
    event = watch.wait_for(lambda event: event["id"] == IDS[1])
    assert event["urls"][0].startswith("rr+tcp://10.77.0.2:")
    serve(start, "ours", 2, "our.node", IDS[2], 0, "ipv4")
    event = watch.wait_for(lambda event: event["id"] == IDS[2])
    assert event["urls"][0].startswith("rr+tcp://10.77.0.3:")
    assert {IDS[1], IDS[2]} <= set(search(network, 3, *THEIRS, "detected", "ipv4"))


def test_a_new_service_changes_the_nonce(network, start):
    watch = Watch(start(0, OURS, "watch"))
    node = serve(start, "ours", 1, "a.node", IDS[2])
    first = watch.wait_for(lambda event: event["id"] == IDS[2])
    node.write_line("another one")
    second = watch.wait_for(lambda event: event["id"] == IDS[2])
    assert second["event"] == "changed" and second["nonce"] != first["nonce"]
    assert len(search(network, 2, OURS, "find-type", TYPE)["found"]) == 2


@pytest.mark.parametrize("implementation", ["ours", "theirs"])
def test_a_node_that_restarts_on_another_port_is_found_again(network, start, implementation):
    watch = Watch(start(0, OURS, "watch"))
    before = serve(start, implementation, 1, "a.node", IDS[3], 50001)
    watch.wait_for(lambda event: event["id"] == IDS[3] and any(":50001/" in url for url in event["urls"]))
    before.process.kill()
    before.process.wait()
    serve(start, implementation, 1, "a.node", IDS[3], 50002)
    watch.wait_for(lambda event: event["id"] == IDS[3] and any(":50002/" in url for url in event["urls"]))
    (service,) = search(network, 2, OURS, "find-type", TYPE)["found"]
    assert ":50002/" in service["url"]


def subscribed(event, node_id):
    return lambda found: (found["event"], found["id"]) == (event, node_id)


@pytest.mark.parametrize("implementation", ["ours", "theirs"])
def test_a_subscription_by_type_follows_nodes_that_come_and_restart(network, start, implementation):
    # The reference can't listen on a port again for a minute: the system still holds its connections.
    ports = {"ours": [50011, 50011, 50012], "theirs": [50021, 50022, 50023]}[implementation]
    watch = Watch(start(0, OURS, "subscribe-type", TYPE))
    first = serve(start, implementation, 1, "a.node", IDS[1], ports[0])
    assert watch.wait_for(subscribed("connected", IDS[1]))["one"] == 1
    serve(start, implementation, 2, "b.node", IDS[2])
    watch.wait_for(subscribed("connected", IDS[2]))
    for port in ports[1:]:
        first.process.kill()
        first.process.wait()
        watch.wait_for(subscribed("lost", IDS[1]))
        first = serve(start, implementation, 1, "a.node", IDS[1], port)
        assert watch.wait_for(subscribed("connected", IDS[1]), seconds=10)["one"] == 1


def test_a_subscription_by_type_of_the_reference_follows_our_nodes(network, start):
    watch = Watch(start(0, *THEIRS, "subscribe-type", TYPE))
    serve(start, "ours", 2, "b.node", IDS[2])
    watch.wait_for(subscribed("connected", IDS[2]), seconds=REFERENCE_DEADLINE)
    first = serve(start, "ours", 1, "a.node", IDS[1], 50041)
    assert watch.wait_for(subscribed("connected", IDS[1]), seconds=REFERENCE_DEADLINE)["one"] == 1
    first.process.kill()
    first.process.wait()
    watch.wait_for(subscribed("lost", IDS[1]))
    serve(start, "ours", 1, "a.node", IDS[1], 50042)
    assert watch.wait_for(subscribed("connected", IDS[1]), seconds=REFERENCE_DEADLINE)["one"] == 1


def test_the_device_connector_of_the_companion_finds_our_devices_by_their_attributes(network, start):
    """Each service of ours has its node's name and NodeID as its device, and its own name as a tag."""
    serve(start, "ours", 2, "b.node", IDS[2])
    late = Watch(start(0, *THEIRS, "connect-device", TYPE, f"a.node|{IDS[1]}", "thing1"))
    named = Watch(start(3, *THEIRS, "connect-device", TYPE, "b.node", "thing"))
    event = named.wait_for(lambda event: event["event"] == "connected", seconds=REFERENCE_DEADLINE)
    assert (event["id"], event["service"], event["one"]) == (IDS[2], "thing", 1)
    node = serve(start, "ours", 1, "a.node", IDS[1])
    node.write_line("another one")
    event = late.wait_for(lambda event: event["event"] == "connected", seconds=REFERENCE_DEADLINE)
    assert (event["id"], event["service"], event["one"]) == (IDS[1], "thing1", 1)


def test_a_subscription_by_url_outlives_the_service(network, start):
    before = serve(start, "theirs", 1, "a.node", IDS[3], 50031, "ipv4")
    urls = [f"rr+tcp://10.77.0.2:{port}/?service=thing" for port in (50031, 50032)]
    watch = Watch(start(0, OURS, "subscribe", *urls))
    watch.wait_for(subscribed("connected", IDS[3]))
    before.process.kill()
    before.process.wait()
    watch.wait_for(subscribed("lost", IDS[3]))
    serve(start, "theirs", 1, "a.node", IDS[3], 50032, "ipv4")
    assert watch.wait_for(subscribed("connected", IDS[3]), seconds=10)["one"] == 1


def test_the_index_of_a_gateway_names_its_address_without_the_zone(network, start, tmp_path):
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({"listen": ["[::]:8080"], "insecure": True, "devices": [
        {"name": "away", "url": "rr+tcp://127.0.0.1:1/?service=thing", "mode": "shared"}]}))
    gateway = start(0, BUILD / "server" / "rrgate", "serve", "--config", config)
    gateway.wait_until(lambda: "listening" in gateway.description())
    index = f"rr+tcp://[{network.link_local(0)}%eth0]:8080/?service=RobotRaconteurServiceIndex"
    (node,) = search(network, 1, BUILD / "server" / "rrgate", "call", index, "GetRoutedNodes", "--json").values()
    (url,) = node["ServiceIndexConnectionURL"].values()
    assert url.startswith(f"rr+tcp://[{network.link_local(0)}]:8080/?nodeid=")


def test_a_gateway_finds_three_nodes_and_uses_those_it_may(network, start, tmp_path):
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({"listen": ["127.0.0.1:8080"], "devices": [], "retry": {"min_ms": 100, "online_ms": 1000},
                                  "discover": {"allow": [{"node_name": "lab.*"}, {"service_type": TYPE, "node_id": IDS[7]}]}}))
    serve(start, "ours", 0, "lab.ours", IDS[5])
    theirs = serve(start, "theirs", 1, "lab.theirs", IDS[6], 50001)
    serve(start, "theirs", 2, "home.node", IDS[7])
    serve(start, "ours", 2, "home.other", IDS[4])
    gateway = start(3, BUILD / "server" / "rrgate", "serve", "--config", config)

    def ask(what, is_wanted, port=8080):
        deadline = time.monotonic() + FIND_DEADLINE + 5
        while not is_wanted(answer := network.get_json(3, f"http://127.0.0.1:{port}/api/v1/{what}")):
            assert time.monotonic() < deadline, f"{answer}\n{gateway.description()}"
        return answer

    def online(answer):
        return answer and {device["name"] for device in answer["devices"] if device["state"] == "online"}

    names = {"lab.ours", "lab.theirs", "home.node"}
    devices = ask("devices", lambda answer: online(answer) == names)["devices"]
    assert all(device["found"] and device["services"] == [{"name": "thing", "type": TYPE, "implements": []}] for device in devices)
    nodes = ask("discovery", lambda answer: len(answer["nodes"]) == 4)["nodes"]
    assert {node["node_name"]: node["allowed"] for node in nodes} == {**dict.fromkeys(names, True), "home.other": False}
    assert all(node["age"] < 20 and "%eth0]" in node["urls"][0]["url"] for node in nodes)
    # Who may use other services alone sees of a node that it is there.
    guests = tmp_path / "guests.json"
    rules = [{"roles": ["guest"], "services": ["other"], "may": ["read"]}]
    guests.write_text(json.dumps({**json.loads(config.read_text()), "listen": ["127.0.0.1:8081"],
                                  "access": {"anonymous_role": "guest", "rules": rules}}))
    start(3, BUILD / "server" / "rrgate", "serve", "--config", guests)
    seen = ask("discovery", lambda answer: answer and [node["services"] is None for node in answer["nodes"]] == [False] * 3, 8081)["nodes"]
    assert [node["services"] for node in seen] == [[]] * 3
    # One that restarts on another port stays the same device.
    theirs.process.kill()
    theirs.process.wait()
    serve(start, "theirs", 1, "lab.theirs", IDS[6], 50002)
    ask("devices", lambda answer: any(":50002/" in device["url"] and device["state"] == "online" for device in answer["devices"]))


def announcement(node_id, host, port):
    return (f"Robot Raconteur Node Discovery Packet\n{{{node_id}}},a.node\n"
            f"rr+tcp://{host}:{port}/?nodeid={node_id}&service=RobotRaconteurServiceIndex\n").encode()


def say_to_group(group, text):
    """Sends the packet from the address of the host on which it is called."""
    with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as sender:
        sender.sendto(text, (group, PORT, 0, socket.if_nametoindex("eth0")))


def forge(source, group, text):
    """The same, as if from another address: UDP over IPv6 by hand."""
    ends = socket.inet_pton(socket.AF_INET6, source) + socket.inet_pton(socket.AF_INET6, group)
    size = 8 + len(text)
    summed = ends + struct.pack("!II4H", size, socket.IPPROTO_UDP, PORT, PORT, size, 0) + text + b"\0" * (len(text) % 2)
    total = sum(struct.unpack(f"!{len(summed) // 2}H", summed))
    while total > 0xFFFF:
        total = (total & 0xFFFF) + (total >> 16)
    packet = struct.pack("!IHBB", 6 << 28, size, socket.IPPROTO_UDP, 1) + ends
    packet += struct.pack("!4H", PORT, PORT, size, total ^ 0xFFFF) + text
    with socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM) as sender:
        sender.sendto(packet, ("eth0", 0x86DD, 0, 0, b"\x33\x33\0\0\xba\x86"))


def test_a_loopback_address_is_taken_from_nobody_else_on_the_link(network, start):
    watch = Watch(start(0, OURS, "watch", "all"))
    for group in GROUPS:
        for host in ("127.0.0.1", "[::1]"):
            network.call(1, lambda: forge(network.link_local(0), group, announcement(IDS[0], host, 9999)))
    # Packets come in the order in which they were sent.
    network.call(1, lambda: say_to_group("ff02::ba86", announcement(IDS[1], f"[{network.link_local(1)}]", 9998)))
    network.call(0, lambda: say_to_group("ff01::ba86", announcement(IDS[2], "127.0.0.1", 9997)))
    heard = set()
    watch.wait_for(lambda event: heard.add(event["id"]) or {IDS[1], IDS[2]} <= heard)
    assert IDS[0] not in heard


def test_nodes_are_found_again_when_an_interface_had_no_ipv6_for_a_while(network, start):
    """Its memberships have gone with its addresses; its number has stayed."""
    with network.call(1, lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as heard:
        heard.bind(("", PORT))
        heard.settimeout(10)

        def hear_requests():
            """The three that are sent whenever the addresses have changed."""
            for _ in range(3):
                assert b"Request" in heard.recv(8192)

        watch = Watch(start(0, OURS, "watch", "all"))
        hear_requests()
        with network.without_ipv6(0):
            hear_requests()
    serve(start, "ours", 1, "a.node", IDS[1])
    watch.wait_for(lambda event: event["id"] == IDS[1], seconds=20)


def test_nodes_are_found_again_when_an_interface_had_no_ipv6_for_a_moment(network, start):
    """Its memberships have gone, but the same addresses are there when the program looks again, which it does every 5 s."""
    with network.call(1, lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as heard:
        heard.bind(("", PORT))
        heard.settimeout(10)
        watch = Watch(start(0, OURS, "watch", "all"))
        assert b"Request" in heard.recv(8192)  # the first of three
        with network.without_ipv6(0):
            pass
        for _ in range(2 + 3):
            assert b"Request" in heard.recv(8192)
    serve(start, "ours", 1, "a.node", IDS[1])
    watch.wait_for(lambda event: event["id"] == IDS[1], seconds=20)


def test_localhost_is_served_by_a_machine_without_ipv6(network, start, tmp_path):
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({"listen": ["localhost:8082"], "devices": []}))
    hosts = tmp_path / "hosts"
    hosts.write_text("::1 localhost\n127.0.0.1 localhost\n")
    off = "net.ipv6.conf.lo.disable_ipv6"
    assert run(*network.on(3, "sysctl", "-w", f"{off}=1")).returncode == 0
    try:
        gateway = start(3, "unshare", "--mount", "sh", "-c", f"mount --bind {hosts} /etc/hosts && "
                        f"exec {BUILD}/server/rrgate serve --config {config}")
        deadline = time.monotonic() + 10
        while not (answer := network.get_json(3, "http://127.0.0.1:8082/api/v1/devices")):
            assert time.monotonic() < deadline, gateway.description()
            time.sleep(0.05)
        assert answer["devices"] == []
    finally:
        run(*network.on(3, "sysctl", "-w", f"{off}=0"))


def node_that_dies_is_lost(network, start):
    watch = Watch(start(0, OURS, "watch"))
    node = serve(start, "theirs", 1, "a.node", IDS[4])
    watch.wait_for(lambda event: event["id"] == IDS[4])
    node.process.kill()
    killed = time.monotonic()
    watch.wait_for(lambda event: event["id"] == IDS[4] and event["event"] == "lost", seconds=65)
    assert time.monotonic() - killed < 62


if "RR_LONG_TESTS" in os.environ:  # what expires when is in the tests of core/discovery; this is it in earnest
    test_a_node_that_dies_is_lost_within_a_minute = node_that_dies_is_lost
