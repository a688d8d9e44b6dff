"""The gateway behind reverse proxies, each with the configuration that gateway-config/proxies/ has for it."""
import json
import os
import re
import socket
import struct
import sys
import time

import pytest
import yaml

from clients import run_and_check
from clients import JS, run_program
from directions import PEERS
from gateways import rrgate
from http_api import BASE, CLIENT, Stream, ask, fetch, open_websocket
from processes import Background, start_gateway
from reverse_proxies import CONFIGS, PROXIES, ReverseProxy
from scenarios import SCENARIO

IDLE_SECONDS = float(os.environ.get("RRGATE_IDLE_SECONDS", "2"))  # longer than what the proxies' other timeouts allow here
CLUSTERS = ["../cluster/nginx.conf", "../cluster/haproxy.cfg"]
STEPS = SCENARIO["functions"].steps + SCENARIO["large_arrays"].steps + SCENARIO["events"].steps


@pytest.fixture(scope="module")
def gateway(device, tmp_path_factory):
    """(port, log file) of a gateway that trusts the proxies of this machine."""
    folder = tmp_path_factory.mktemp("gateway")
    devices = [{"name": "interop", "url": device}, {"name": "shared", "url": device, "mode": "shared"}]
    process, port = start_gateway(folder, device, devices=devices, trusted_proxies=["127.0.0.1"])
    yield port, folder / "gateway.log"
    process.stop()


@pytest.fixture(scope="module", params=list(PROXIES))
def proxy(request, gateway, tmp_path_factory):
    running = ReverseProxy(request.param, PROXIES[request.param], tmp_path_factory.mktemp(request.param), gateway[0])
    yield running
    running.stop()


@pytest.fixture(params=["root", "below a path"])
def site(request, proxy):
    """(port, path before all others)."""
    return (proxy.root, "") if request.param == "root" else (proxy.below, "/robots")


def name_of(config):
    """Of the proxy whose configuration it is."""
    return next((name for name, file in PROXIES.items() if file == config), config.split("/")[-1].split(".")[0])


def device_of(port, prefix, headers={}):
    status, _, body = fetch(port, prefix + "/api/v1/devices", headers)
    assert status == 200, body
    return next(entry for entry in json.loads(body)["devices"] if entry["name"] == "interop")


def last_client(log, since):
    """The peer of the last client that connected, as the log names it."""
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        found = re.findall(r"client connected .*peer=(\S+)", log.read_text()[since:])
        if found:
            return found[-1]
        time.sleep(0.02)
    raise AssertionError("nobody connected")


def connected_as(port, path, log, headers=""):
    since = len(log.read_text())
    open_websocket(port, path, headers).close()
    return last_client(log, since)


def test_the_page_and_all_that_it_loads(site):
    port, prefix = site
    status, headers, body = fetch(port, prefix + "/")
    assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    links = re.findall(r'(?:src|href)="([^"]+)"', body.decode())
    assets = [link for link in links if not link.startswith("api/")]
    assert len(assets) >= 4, links
    scripts = ""
    for link in assets:
        assert link.startswith("./"), f"{link} would leave the path of the page"
        status, headers, content = fetch(port, prefix + link[1:])
        assert status == 200, link
        if link.endswith(".js"):
            assert headers["Content-Type"].startswith("text/javascript")
            scripts += content.decode()
    (wasm,) = set(re.findall(r"rrgate-[\w-]+\.wasm", scripts))
    status, headers, content = fetch(port, f"{prefix}/assets/{wasm}")
    assert (status, headers["Content-Type"], content[:4]) == (200, "application/wasm", b"\0asm")


def test_the_page_below_a_path_has_its_slash(proxy):
    status, headers, _ = fetch(proxy.below, "/robots")
    assert status == 308
    assert re.fullmatch(r"(http://[^/]+)?/robots/", headers["Location"]), headers["Location"]


def test_metrics_are_not_for_everybody(site):
    port, prefix = site
    assert fetch(port, prefix + "/metrics")[0] == 403
    for other in ("/%6detrics", "//metrics", "/./metrics", "/metrics/"):
        assert fetch(port, prefix + other)[0] in (403, 404), other


@pytest.mark.parametrize("client", ["reference", "node"])
def test_sessions(site, client):
    """By the very URL that the API names, 10 MB arrays included."""
    port, prefix = site
    entry = device_of(port, prefix)
    assert entry["websocket_url"] == f"ws://127.0.0.1:{port}{prefix}/devices/interop"
    run_and_check(client, entry["websocket_url"] + "?service=interop", STEPS)


def test_what_is_escaped_in_a_path_arrives_escaped(site):
    """A slash in the key of an object is no slash of the path."""
    port, prefix = site
    status, _, body = fetch(port, prefix + BASE + "/named/left%2Fright/name")
    assert (status, json.loads(body)) == (200, "named left/right")
    assert json.loads(fetch(port, prefix + BASE + "/named/right%20hand/name?of=nothing")[2]) == "named right hand"


@pytest.mark.parametrize("config", [*PROXIES.values(), *CLUSTERS])
def test_large_bodies(config, gateway, tmp_path):
    """2 MB, of the 16 MB that the gateway takes."""
    proxy = ReverseProxy(name_of(config), config, tmp_path, gateway[0], {number: gateway[0] for number in (8091, 8092, 8093)})
    try:
        for port, prefix in [(proxy.root, "")] + [(proxy.below, "/robots")] * (config not in CLUSTERS):
            done = ask(port, "PUT", prefix + BASE + "/p_string", "2 MB" * 500_000)
            assert done.status == 204, done.body
    finally:
        proxy.stop()


def test_each_event_of_a_stream_comes_at_once(site, gateway):
    """None waits in the proxy for others to come, or for what the client acknowledges."""
    port, prefix = site

    def seconds(port, base):
        """Of 40 events, each asked for when the one before has come."""
        stream = Stream(port, base + "/changed")
        began = time.monotonic()
        for _ in range(40):
            assert ask(port, "POST", base + "/fire", {"count": 1}).status == 200
            stream.next()
        stream.close()
        return time.monotonic() - began

    direct, through = seconds(gateway[0], BASE), seconds(port, prefix + BASE)
    assert through < direct + 40 * 0.05, (direct, through)


def test_nobody_says_by_a_header_who_he_is(device, tmp_path, proxy):
    """The gateway believes the proxy, and the proxy takes away what clients put there."""
    access = {"identity_headers": {"user": "X-Forwarded-User", "roles": "X-Forwarded-Groups"}}
    gateway, port = start_gateway(tmp_path, device, trusted_proxies=["127.0.0.1"], access=access,
                                  is_up=lambda: "device online" in (tmp_path / "gateway.log").read_text())
    says = {"X-Forwarded-User": "root", "X-Forwarded-Groups": "admin"}
    another = ReverseProxy(proxy.name, PROXIES[proxy.name], tmp_path, port)
    try:
        assert json.loads(fetch(port, "/api/v1/access", says, "127.0.0.1")[2])["user"] == "root"
        for site, prefix in ((another.root, ""), (another.below, "/robots")):
            status, _, body = fetch(site, prefix + "/api/v1/access", says)
            assert (status, json.loads(body)["user"], json.loads(body)["roles"]) == (200, None, [])
    finally:
        another.stop()
        gateway.stop()


def test_who_the_client_is(site, gateway):
    port, prefix = site
    forged = "X-Forwarded-For: 6.6.6.6\r\nForwarded: for=6.6.6.6;proto=https\r\n"
    assert connected_as(port, prefix + "/devices/interop", gateway[1], forged) == CLIENT


def test_what_a_client_forges_for_others(site):
    port, prefix = site
    entry = device_of(port, prefix, {"X-Forwarded-Host": "evil.example", "X-Forwarded-Proto": "https",
                                     "X-Forwarded-Prefix": "/evil", "Forwarded": "host=evil.example"})
    assert entry["websocket_url"] == f"ws://127.0.0.1:{port}{prefix}/devices/interop"


def test_a_page_of_the_proxys_host_may_connect(site):
    port, prefix = site
    open_websocket(port, prefix + "/devices/interop", f"Origin: http://127.0.0.1:{port}\r\n").close()
    with pytest.raises(AssertionError, match="403"):
        open_websocket(port, prefix + "/devices/interop", "Origin: http://evil.example\r\n")


def test_an_idle_session(proxy):
    """Silent for longer than a request may be; then the gateway still hears it."""
    port = proxy.root
    link = open_websocket(port, "/devices/interop", f"Origin: http://127.0.0.1:{port}\r\n")
    link.settimeout(IDLE_SECONDS)
    with pytest.raises(TimeoutError):
        link.recv(1)
    link.settimeout(10)
    link.sendall(b"\x82\x84\0\0\0\0XXXX")  # no Robot Raconteur: the gateway says so in its close frame
    assert b"from the client: " in link.recv(4096)
    link.close()


@pytest.mark.parametrize("config", [*PROXIES.values(), *CLUSTERS])
def test_an_answer_that_takes_its_time(config, tmp_path):
    """The device is held for longer than clients may be silent: it is the gateway that says how long to wait."""
    device = Background([sys.executable, PEERS / "service.py"], tmp_path / "device.log")
    url = json.loads(device.next_line())["url"]
    process, port = start_gateway(tmp_path, url, trusted_proxies=["127.0.0.1"])
    proxy = ReverseProxy(name_of(config), config, tmp_path, port, {number: port for number in (8091, 8092, 8093)})
    try:
        asked = f"GET {BASE}/p_double HTTP/1.1\r\nHost: 127.0.0.1:{proxy.root}\r\nConnection: close\r\n\r\n".encode()
        assert fetch(proxy.root, f"{BASE}/p_double")[0] == 200
        device.pause()
        with socket.create_connection(("127.0.0.1", proxy.root), IDLE_SECONDS) as link:
            link.sendall(asked)
            with pytest.raises(TimeoutError):
                link.recv(1)
            device.resume()
            link.settimeout(10)
            assert b" 200 " in link.recv(4096)
    finally:
        for each in (proxy, process, device):
            each.stop()


@pytest.mark.parametrize("name", ["interop", "shared"])
def test_a_reload_of_the_proxy(proxy, name, tmp_path):
    """Costs a subscription less than 2 s; docs/reverse-proxy.md says what it costs with each. The definitions of a shared
    device do not cross again; those of a device of the package do, if it is relayed."""
    url = f"ws://127.0.0.1:{proxy.root}/devices/{name}?service=interop"
    client = Background(["node", JS / "reload.mjs", url], tmp_path / "client.log")
    try:
        client.next_line()
        proxy.reload()
        time.sleep(1)  # proxies tell nobody when they have reloaded
        client.write_line("tell")
        told = json.loads(client.next_line())
        assert told["value"] == 3
        assert told["longest"] < 2000, told
        if proxy.name == "caddy":
            assert told["losses"] > 0, "it closes WebSockets when it reloads"
        first, *others = told["connects"]
        assert len(others) == told["losses"]
        assert first["received"] > told["definitions"] > 1000
        for again in others:
            assert again["sent"] == first["sent"]
            if name == "shared":
                assert again["received"] < first["received"] - told["definitions"]
            else:
                assert abs(again["received"] - first["received"]) < 16  # numbers of other lengths
        print(f"{proxy.name}: {told['losses']} losses, the longest {told['longest']:.0f} ms, {told['connects']}")
    finally:
        client.stop()
    # The proxy goes on with new connections.
    assert device_of(proxy.root, "")["state"] == "online"


def test_headers_of_others_are_ignored(gateway):
    port, log = gateway
    entry = device_of(port, "", {"X-Forwarded-Host": "evil.example", "X-Forwarded-Proto": "https", "X-Forwarded-Prefix": "/x"})
    assert entry["websocket_url"] == f"ws://127.0.0.1:{port}/devices/interop"
    peer = connected_as(port, "/devices/interop", log, "X-Forwarded-For: 6.6.6.6\r\n")
    assert re.fullmatch(re.escape(CLIENT) + r":\d+", peer)


def test_forwarded(device, tmp_path):
    process, port = start_gateway(tmp_path, device, trusted_proxies=["127.0.0.2"], proxy_headers="forwarded",
                                  allowed_hosts=["lab.example"])
    try:
        header = {"Forwarded": 'for="[2001:db8::7]:99";proto=https;host=lab.example', "X-Forwarded-Host": "evil.example"}
        assert device_of(port, "", header)["websocket_url"] == "wss://lab.example/devices/interop"
        log = tmp_path / "gateway.log"
        assert connected_as(port, "/devices/interop", log, "Forwarded: for=192.0.2.7\r\n") == "192.0.2.7"
    finally:
        process.stop()


@pytest.mark.parametrize("client", ["reference", "node"])
def test_a_base_path(device, tmp_path, client):
    process, port = start_gateway(tmp_path, device, base_path="/lab")
    try:
        assert fetch(port, "/lab/")[0] == fetch(port, "/lab/healthz")[0] == fetch(port, "/healthz")[0] == 200
        status, headers, _ = fetch(port, "/lab")
        assert (status, headers["Location"]) == (308, "/lab/")
        entry = device_of(port, "/lab")
        assert entry["websocket_url"] == f"ws://127.0.0.1:{port}/lab/devices/interop"
        run_and_check(client, entry["websocket_url"] + "?service=interop", SCENARIO["functions"].steps)
    finally:
        process.stop()


@pytest.mark.parametrize("version", ["send-proxy", "send-proxy-v2"])
def test_proxy_protocol(device, tmp_path, monkeypatch, version):
    """Every protocol of the port through a TCP proxy; the log names the client."""
    process, port = start_gateway(tmp_path, device, trusted_proxies=["127.0.0.1/32"], proxy_protocol="required",
                                  asked_from=CLIENT)
    configs = tmp_path / "configs"
    configs.mkdir()
    text = (CONFIGS / "haproxy-tcp.cfg").read_text()
    assert "send-proxy-v2" in text
    (configs / "haproxy-tcp.cfg").write_text(text.replace("send-proxy-v2", version))
    monkeypatch.setattr("reverse_proxies.CONFIGS", configs)
    folder = tmp_path / "haproxy"
    folder.mkdir()
    proxy = ReverseProxy("haproxy", "haproxy-tcp.cfg", folder, port)
    log = tmp_path / "gateway.log"
    try:
        assert device_of(proxy.root, "")["websocket_url"] == f"ws://127.0.0.1:{proxy.root}/devices/interop"
        assert connected_as(proxy.root, "/devices/interop", log).startswith(CLIENT + ":")
        run_and_check("node", f"ws://127.0.0.1:{proxy.root}/devices/interop?service=interop", STEPS)
        steps, native = SCENARIO["functions"].steps, f"rr+tcp://127.0.0.1:{proxy.root}/?nodename=interop.service&service=interop"
        run_and_check("reference", native, steps)

        # Whoever is not trusted is what its address says, and nothing that a proxy would say.
        with socket.create_connection(("127.0.0.1", port), 10, source_address=(CLIENT, 0)) as link:
            link.sendall(b"PROXY TCP4 6.6.6.6 127.0.0.1 1 1\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert link.recv(4096).startswith(b"HTTP/1.1 400 ")
        # The proxy itself must say it.
        with socket.create_connection(("127.0.0.1", port), 10) as link:
            link.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert link.recv(4096) == b""
        # Its own machine asks as a proxy that speaks for itself.
        assert rrgate("health", f"127.0.0.1:{port}") == f"127.0.0.1:{port}: HTTP/1.0 200 OK"
        block = b"\r\n\r\n\0\r\nQUIT\n\x21\x11" + struct.pack(">H4s4sHH", 12, bytes([192, 0, 2, 7]), bytes(4), 4711, 80)
        with socket.create_connection(("127.0.0.1", port), 10) as link:
            for byte in block:  # in as many pieces as there can be
                link.sendall(bytes([byte]))
            link.sendall(b"nonsense")
            link.recv(4096)
        process.wait_until(lambda: "192.0.2.7:4711" in log.read_text())  # it is written behind the answer
    finally:
        proxy.stop()
        process.stop()


TRAEFIK = {  # of what the file uses: the reference of Traefik's dynamic configuration
    "routers": {"rule", "service", "middlewares"},
    "services": {"loadBalancer": {"servers"}},
    "middlewares": {"redirectRegex": {"regex", "replacement"}, "stripPrefix": {"prefixes"}, "headers": {"customRequestHeaders"}},
}


def test_traefiks_configuration_fits_together():
    """It is not started here: its options are known ones, its rules are rules, and what it names is there."""
    parts = yaml.safe_load((CONFIGS / "traefik.yaml").read_text())["http"]
    assert parts.keys() == TRAEFIK.keys()
    for router in parts["routers"].values():
        assert router.keys() <= TRAEFIK["routers"]
        assert router["service"] in parts["services"]
        assert set(router.get("middlewares", [])) <= parts["middlewares"].keys()
        assert re.fullmatch(r"!?(Host|Path|PathPrefix)\(`[^`]+`\)( && !?(Host|Path|PathPrefix)\(`[^`]+`\))*", router["rule"])
    for kind in ("services", "middlewares"):
        for entry in parts[kind].values():
            ((name, options),) = entry.items()
            assert options.keys() <= TRAEFIK[kind][name]
    (service,) = parts["services"].values()
    assert all(server.keys() == {"url"} for server in service["loadBalancer"]["servers"])
    redirect = parts["middlewares"]["rrgate-slash"]["redirectRegex"]
    to = re.sub(redirect["regex"], redirect["replacement"].replace("${1}", r"\1"), "https://lab.example/robots")
    assert to == "https://lab.example/robots/"
