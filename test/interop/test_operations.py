"""The gateway as a service: metrics, configuration read anew, what a service manager gives and hears, stopping."""
import configparser
import contextlib
import http.client
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import time

import pytest

from chaos import FAKETIME
from clients import run_and_check
from gateways import RRGATE, Gateway, read_metrics, running
from http_api import BASE, Stream, fetch, is_alive, open_websocket
from processes import ROOT, free_port
from scenarios import SCENARIO


def interop(device, **more):
    return {"name": "interop", "url": device, **more}


def test_metrics(device, tmp_path):
    dead = {"name": "dead", "url": f"rr+tcp://127.0.0.1:{free_port()}/?service=x"}
    with running(tmp_path, {"devices": [interop(device, max_clients=1), dead]}) as gateway:
        link = gateway.session()
        before = gateway.metrics()
        for name, value in {
            'rrgate_device_up{device="interop"}': 1, 'rrgate_device_up{device="dead"}': 0,
            'rrgate_sessions{device="interop"}': 1, 'rrgate_sessions_total{device="interop"}': 1,
            'rrgate_relayed_bytes_total{device="interop",direction="to_device"}': 0,
            'rrgate_waiting_bytes{device="interop",direction="to_clients"}': 0,
            'rrgate_rejected_total{reason="origin"}': 0,
        }.items():
            assert before[name] == value, name
        assert before["rrgate_connections"] == 2 and before["process_open_fds"] > 5

        # One message of 64 bytes there, and what the service says to it back.
        message = b"RRAC" + (64).to_bytes(4, "little") + (2).to_bytes(2, "little") + (64).to_bytes(2, "little") + bytes(52)
        link.sendall(b"\x82" + bytes([0x80 | len(message)]) + bytes(4) + message)
        for path, headers in [("/devices/dead", ""), ("/devices/nobody", ""), ("/devices/interop", ""),
                              ("/devices/interop", "Origin: http://evil.example\r\n")]:
            with pytest.raises(AssertionError):
                open_websocket(gateway.port, path, headers)
        with socket.create_connection(("127.0.0.1", gateway.port), 10) as noise:
            noise.sendall(b"\0\0\0\0")
            noise.recv(100)
        after = gateway.metrics()
        assert after['rrgate_relayed_bytes_total{device="interop",direction="to_device"}'] == 64
        assert after['rrgate_relayed_messages_total{device="interop",direction="to_device"}'] == 1
        for reason in ("device_offline", "no_such_device", "device_full", "origin", "unknown_protocol"):
            assert after[f'rrgate_rejected_total{{reason="{reason}"}}'] == 1, reason
        assert after["rrgate_connections_total"] > before["rrgate_connections_total"]
        link.close()


def test_metrics_of_requests(device, tmp_path):
    """Responses by status; how long they took, but for streams and images; processor time."""
    duration = "rrgate_http_request_duration_seconds"

    def responses(metrics):
        return [metrics[f'rrgate_http_responses_total{{code="{code}xx"}}'] for code in range(1, 6)]

    with running(tmp_path, {"devices": [interop(device)]}) as gateway:
        gateway.wait_for("device online", device="interop")
        fetch(gateway.port, "/healthz")
        before = gateway.metrics()
        for _ in range(20):
            assert fetch(gateway.port, "/api/v1/devices")[0] == 200
        assert fetch(gateway.port, "/api/v1/devices/nobody")[0] == 404
        assert fetch(gateway.port, "/devices/interop")[0] == 426
        Stream(gateway.port, "/changed", base=BASE).close()
        link = gateway.session()
        with socket.create_connection(("127.0.0.1", gateway.port), 10) as broken:
            broken.sendall(b"GET / HTTP/1.1\r\n\r\n")
            assert broken.recv(100).startswith(b"HTTP/1.1 400 ")
        after = gateway.metrics()
        # /metrics itself is answered after it is written.
        assert [new - old for new, old in zip(responses(after), responses(before))] == [1, 22, 0, 3, 0]
        assert after[f"{duration}_count"] - before[f"{duration}_count"] == 23  # neither the stream, nor what was no request
        assert after[f'{duration}_bucket{{le="+Inf"}}'] == after[f"{duration}_count"]
        assert 0 < after[f"{duration}_sum"] - before[f"{duration}_sum"] < 10
        assert 0 < after["process_cpu_seconds_total"] - before["process_cpu_seconds_total"] < 60
        link.close()


def test_metrics_of_a_shared_device(device, tmp_path):
    """What a client had stays counted when it has gone."""
    with running(tmp_path, {"devices": [interop(device, mode="shared")]}) as gateway:
        gateway.wait_for("session open")
        url = f"rr+tcp://127.0.0.1:{gateway.port}/?nodename=interop&service=interop"
        assert gateway.metrics()['rrgate_subscription_delivered_total{device="interop",kind="wire"}'] == 0
        run_and_check("reference", url, SCENARIO["wires"].steps)
        first = gateway.metrics()
        assert first['rrgate_sessions{device="interop"}'] == 0
        wires = {name: first[f'rrgate_subscription_{name}_total{{device="interop",kind="wire"}}'] for name in ("delivered", "dropped")}
        assert wires["delivered"] > 0 and wires["dropped"] == 0, wires
        ages = 'rrgate_subscription_age_seconds_{}{{device="interop",kind="wire"{}}}'
        buckets = [value for name, value in first.items() if name.startswith("rrgate_subscription_age_seconds_bucket")]
        assert buckets == sorted(buckets) and buckets[-1] == first[ages.format("count", "")] == wires["delivered"]
        assert 0 < first[ages.format("sum", "")] < 10
        for direction in ("to_device", "to_clients"):
            assert first[f'rrgate_relayed_bytes_total{{device="interop",direction="{direction}"}}'] > 1000
            assert first[f'rrgate_waiting_bytes{{device="interop",direction="{direction}"}}'] == 0
        run_and_check("reference", url, SCENARIO["wires"].steps)
        second = gateway.metrics()
        assert all(second[name] >= value for name, value in first.items() if "_total" in name or "_bucket" in name)
        assert second[ages.format("count", "")] > first[ages.format("count", "")]


@pytest.mark.parametrize("way", ["signal", "watch"])
def test_a_changed_configuration(device, tmp_path, way):
    """Sessions of devices that stay go on; the others end, and say why; new devices and addresses are there."""
    config = {"devices": [interop(device), {"name": "other", "url": device}]}
    with running(tmp_path, config) as gateway:
        stays, goes = gateway.session("interop"), gateway.session("other")
        second = free_port()
        gateway.write({**gateway.config, "devices": [{"name": "new", "url": device}, interop(device, max_clients=1)],
                       "listen": [f"127.0.0.1:{second}"], "base_path": "/lab", "limits": {"header_bytes": 2000}})
        if way == "signal":
            gateway.hang_up()
        gateway.wait_for("configuration read anew")
        assert b"left the configuration" in goes.recv(4096)
        assert is_alive(stays)
        with pytest.raises(OSError):
            socket.create_connection(("127.0.0.1", gateway.port), 5)
        gateway.port = second
        gateway.wait_for("device online", device="new")
        status, _, body = fetch(second, "/lab/api/v1/devices")
        entries = json.loads(body)["devices"]
        assert [entry["name"] for entry in entries] == ["new", "interop"]
        assert [entry["clients"] for entry in entries] == [0, 1]
        with pytest.raises(AssertionError, match="503"):
            open_websocket(second, "/devices/interop")  # max_clients
        gateway.session("new").close()
        assert gateway.metrics()['rrgate_config_reloads_total{result="ok"}'] == 1
        stays.close()


def test_another_name_of_the_node_needs_a_restart_and_that_is_told(device, tmp_path):
    with running(tmp_path, {"devices": [interop(device)], "node": {"name": "before"}}) as gateway:
        gateway.hang_up()
        gateway.wait_for("configuration read anew")
        assert not gateway.events("the gateway's node has its new name and id after a restart")
        gateway.write({**gateway.config, "node": {"name": "after"}})
        gateway.hang_up()
        assert gateway.wait_for("the gateway's node has its new name and id after a restart")["name"] == "before"


def test_streams_of_a_device_that_is_another_one_now_end(device, tmp_path):
    with running(tmp_path, {"devices": [interop(device)]}) as gateway:
        stream = Stream(gateway.port, BASE + "/state")
        gateway.write({**gateway.config, "devices": [interop(f"rr+tcp://127.0.0.1:{free_port()}/?service=interop")]})
        gateway.hang_up()
        gateway.wait_for("configuration read anew")
        with pytest.raises(EOFError):
            while True:
                stream.next()


def test_listening_on_all_addresses_instead_of_one(device, tmp_path):
    """And back, on the same port; where another address is taken, all stays as it was."""
    with running(tmp_path, {"devices": [interop(device)], "insecure": True}) as gateway, socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        for count, host in enumerate(["0.0.0.0", "127.0.0.1"]):
            address = f"{host}:{gateway.port}"
            gateway.write({**gateway.config, "listen": [address, "127.0.0.1:%d" % taken.getsockname()[1]]})
            gateway.wait_for("configuration not used; that from before stays", count + 1)
            assert fetch(gateway.port, "/healthz")[0] == 200
            gateway.write({**gateway.config, "listen": [address]})
            gateway.wait_for("configuration read anew", count + 1)
            assert fetch(gateway.port, "/healthz")[0] == 200


def test_discovery_comes_and_goes(tmp_path):
    with running(tmp_path, {"devices": []}) as gateway:
        quiet = {"scopes": ["node_local"], "hardware": False}
        for count, discover in enumerate([quiet, {**quiet, "local": False}, {**quiet, "allow": [{"node_name": "x"}]}, None, quiet], 1):
            gateway.write({**gateway.config, **({"discover": discover} if discover else {})})
            gateway.hang_up()
            gateway.wait_for("configuration read anew", count)
            assert json.loads(fetch(gateway.port, "/api/v1/discovery")[2])["enabled"] == bool(discover)


@pytest.mark.parametrize("wrong", ["no JSON", "no such option", "a certificate that is missing", "an address in use", "gone"])
def test_a_configuration_that_cannot_be_used(device, tmp_path, wrong):
    with running(tmp_path, {"devices": [interop(device)]}) as gateway:
        link = gateway.session()
        with socket.create_server(("127.0.0.1", 0)) as taken:
            address = f"127.0.0.1:{taken.getsockname()[1]}"
            if wrong == "gone":
                gateway.file.unlink()
            else:
                gateway.write({
                    "no JSON": '{"listen": [',
                    "no such option": {**gateway.config, "colour": 1},
                    "a certificate that is missing": {**gateway.config, "devices": [], "tls": {"certificates": [{"cert": "x", "key": "y"}]}},
                    "an address in use": {**gateway.config, "devices": [], "listen": [address]},
                }[wrong])
            gateway.hang_up()
            error = gateway.wait_for("configuration not used; that from before stays")["error"]
            expected = {"no JSON": "not JSON", "no such option": "/colour", "a certificate that is missing": "x",
                        "an address in use": address, "gone": "can't be read"}[wrong]
            assert expected in error
        assert is_alive(link)
        values = gateway.metrics()
        assert values['rrgate_config_reloads_total{result="failed"}'] == 1
        assert values['rrgate_device_up{device="interop"}'] == 1
        link.close()


@pytest.fixture
def manager(tmp_path):
    """Where a service manager listens."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(10)
        yield listener


def test_what_a_service_manager_hears(device, tmp_path, manager):
    environment = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "200000"}

    def hear(*wanted):
        deadline = time.monotonic() + 10
        while time.monotonic() < deadline:
            text = manager.recv(4096).decode().splitlines()
            if text[0] in wanted:
                return text
            assert text[0] == "WATCHDOG=1", text
        raise AssertionError(f"did not hear {wanted}")

    with running(tmp_path, {"devices": [interop(device)], "timeouts": {"drain_ms": 1500}}, environment) as gateway:
        assert hear("READY=1")[1] == "STATUS=serving"
        started = time.monotonic()
        for _ in range(4):
            hear("WATCHDOG=1")
        assert time.monotonic() - started < 5
        gateway.hang_up()
        assert hear("RELOADING=1")[1].startswith("MONOTONIC_USEC=")
        hear("READY=1")
        gateway.write("{")
        gateway.hang_up()
        hear("RELOADING=1")
        assert "can't be used" in hear("READY=1")[1]

        link = gateway.session()
        gateway.process.process.send_signal(signal.SIGTERM)
        hear("STOPPING=1")
        hear("WATCHDOG=1")  # a session that may end in its own time is no hang
        link.close()
        assert gateway.process.process.wait(10) == 0


def test_stopping_waits_for_sessions_and_not_for_ever(device, tmp_path):
    with running(tmp_path, {"devices": [interop(device)], "timeouts": {"drain_ms": 700}}) as gateway:
        link = gateway.session()
        gateway.process.process.send_signal(signal.SIGTERM)
        started = time.monotonic()
        gateway.wait_for("stopping")
        assert fetch(gateway.port, "/readyz")[0] == 503
        assert fetch(gateway.port, "/healthz")[0] == 200
        assert fetch(gateway.port, "/api/v1/devices")[0] == 503
        assert is_alive(link)
        link.settimeout(10)
        assert b"the gateway is stopping" in link.recv(4096)
        assert 0.5 < time.monotonic() - started < 5
        link.close()
        assert gateway.process.process.wait(10) == 0


def test_the_unit_starts_again_where_an_address_comes_late_and_not_where_the_configuration_is_wrong(tmp_path):
    unit = configparser.ConfigParser(strict=False, interpolation=None)
    unit.optionxform = str
    unit.read(ROOT / "gateway-config" / "rrgate.service.in")
    given_up = unit["Service"].get("RestartPreventExitStatus", "").split()

    def serve(config):
        (tmp_path / "gateway.json").write_text(json.dumps({"devices": [], **config}))
        done = subprocess.run([str(RRGATE), "serve", tmp_path / "gateway.json"], capture_output=True, text=True, timeout=20)
        return str(done.returncode), done.stderr

    status, said = serve({"listen": ["192.0.2.1:8080"], "insecure": True})  # an address that this machine has not, or not yet
    assert "192.0.2.1:8080" in said and status not in ["0", *given_up]
    seconds, starts = (int(unit["Unit"][key]) for key in ("StartLimitIntervalSec", "StartLimitBurst"))
    assert unit["Service"]["Restart"] == "on-failure"
    assert starts * int(unit["Service"]["RestartSec"]) > seconds > 0, "systemd gives up, or a client of the socket starts it without end"
    status, said = serve({"listne": []})
    assert "listne" in said and status in given_up


def test_a_second_signal_ends_what_is_left_at_once(device, tmp_path):
    with running(tmp_path, {"devices": [interop(device)], "timeouts": {"drain_ms": 600_000}}) as gateway:
        link = gateway.session()
        gateway.process.process.send_signal(signal.SIGTERM)
        gateway.wait_for("stopping")
        assert is_alive(link)
        gateway.process.process.send_signal(signal.SIGTERM)
        assert gateway.process.process.wait(10) == 0
        assert not is_alive(link)
        link.close()


def test_the_log_has_what_its_level_asks_for(tmp_path):
    class Quiet(Gateway):
        def wait_until_ready(self):
            self.process.wait_until(lambda: "online" not in self.state())

        def state(self):
            try:
                return fetch(self.port, "/api/v1/devices")[2].decode()
            except OSError:
                return "online"  # not known yet

    away = {"name": "away", "url": "rr+tcp://127.0.0.1:1/?service=none"}
    levels = {}
    for level in ("info", "warning", "error"):
        (tmp_path / level).mkdir()
        gateway = Quiet(tmp_path / level, {"devices": [away], "log": {"format": "json", "level": level}})
        gateway.process.wait_until(lambda: '"offline"' in gateway.state())
        assert gateway.process.stop() == 0
        levels[level] = {event["level"] for event in gateway.events()}
    assert levels["info"] >= {"info", "warning"} and "debug" not in levels["info"]
    assert levels["warning"] == {"warning"} and levels["error"] == set()


def test_a_ca_that_is_not_there_is_said_with_the_device_that_it_is_for(tmp_path):
    device = {"name": "arm", "url": "rrs+tcp://127.0.0.1:1/?service=arm", "tls": {"ca": [str(tmp_path / "none.pem")]}}
    (tmp_path / "gateway.json").write_text(json.dumps({"listen": ["127.0.0.1:0"], "devices": [device]}))
    done = subprocess.run([str(RRGATE), "serve", tmp_path / "gateway.json"], capture_output=True, text=True, timeout=20)
    assert done.returncode == 1 and "device 'arm': CA file" in done.stderr.replace("\\'", "'")


@contextlib.contextmanager
def handed(listener, folder, devices):
    """A gateway that is given a socket as systemd does it: number 3, and the process that it is for. (process, its log)"""
    start = "import os, sys; os.dup2(int(sys.argv[1]), 3); os.set_inheritable(3, True); " \
        "os.environ.update(LISTEN_FDS='1', LISTEN_PID=str(os.getpid())); os.execv(sys.argv[2], sys.argv[2:])"
    config, log = folder / "gateway.json", folder / "gateway.log"
    config.write_text(json.dumps({"listen": ["127.0.0.1:1"], "devices": devices}))
    with open(log, "wb") as errors:
        process = subprocess.Popen([sys.executable, "-c", start, str(listener.fileno()), str(RRGATE), "serve", "--config", config],
                                   pass_fds=[listener.fileno()], stderr=errors)
    try:
        yield process, log
    finally:
        process.kill()
        process.wait()


def says(log, words):
    deadline = time.monotonic() + 10
    while words not in log.read_text():
        assert time.monotonic() < deadline, log.read_text()
        time.sleep(0.02)


def test_sockets_that_listen_already(device, tmp_path):
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    with handed(listener, tmp_path, [interop(device)]) as (process, log):
        listener.close()
        assert fetch(port, "/healthz")[0] == 200  # a connection waits until somebody takes it
        process.send_signal(signal.SIGHUP)  # the address of the file is not listened on: nothing fails
        says(log, "configuration read anew")
        assert fetch(port, "/readyz")[0] == 200
        process.send_signal(signal.SIGTERM)
        assert process.wait(10) == 0


def test_clients_wait_in_a_socket_that_is_handed_over_while_the_gateway_restarts(device, tmp_path):
    """Also those that come while a session is still given time to end."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        with handed(listener, tmp_path, [interop(device)]) as (process, log):
            says(log, "device online")
            session = open_websocket(port, "/devices/interop", f"Origin: http://127.0.0.1:{port}\r\n")
            says(log, "client connected")
            process.send_signal(signal.SIGTERM)
            says(log, "stopping")
            late = socket.create_connection(("127.0.0.1", port), 10)
            late.sendall(b"GET /api/v1/devices HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert is_alive(session)
            session.close()
            assert process.wait(10) == 0
        with handed(listener, tmp_path, []), late:
            assert b" 200 " in late.recv(4096)


def test_a_reload_looks_at_who_reaches_sockets_that_listen_already(tmp_path):
    """Whatever addresses the configuration names: the socket is not theirs."""
    hand_over = "import os, socket, sys; one = socket.create_server(('0.0.0.0', int(sys.argv[1]))); os.dup2(os.dup(one.fileno()), 3); " \
        "os.environ.update(LISTEN_FDS='1', LISTEN_PID=str(os.getpid())); os.execv(sys.argv[2], sys.argv[2:])"
    port = free_port()
    config = {"listen": ["127.0.0.1:1"], "devices": [], "insecure": True}
    gateway = Gateway(tmp_path, config, command=[sys.executable, "-c", hand_over, port])
    try:
        assert fetch(port, "/healthz")[0] == 200
        gateway.write({**gateway.config, "insecure": False})
        refused = gateway.wait_for("configuration not used; that from before stays")
        assert f"0.0.0.0:{port} is reached from other machines without TLS" in refused["error"]
    finally:
        gateway.process.stop()


def test_a_socket_that_is_none(tmp_path):
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({"listen": ["127.0.0.1:0"], "devices": []}))
    command = ["/bin/sh", "-c", 'exec 3</dev/null; LISTEN_FDS=1 LISTEN_PID=$$ exec "$@"', "sh", RRGATE, "serve", "--config", config]
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=20)
    assert result.returncode == 1
    assert "expected a TCP socket that listens" in result.stderr


def test_health(device, tmp_path):
    def ask(*arguments):
        result = subprocess.run([str(RRGATE), "health", *arguments], capture_output=True, text=True, timeout=20)
        return result.returncode, result.stdout + result.stderr

    with running(tmp_path, {"devices": []}) as gateway:
        address = f"127.0.0.1:{gateway.port}"
        assert ask(address) == ask("--ready", address) == (0, f"{address}: HTTP/1.0 200 OK\n")
    assert ask(address) == (1, f"{address}: no answer\n")
    assert ask("nowhere")[0] == 2


def test_clients_wait_while_there_are_no_descriptors(device, tmp_path):
    with running(tmp_path, {"devices": [{"name": "interop", "url": device}]}) as gateway:
        inside, pid = gateway.session(), gateway.process.process.pid
        kept = http.client.HTTPConnection("127.0.0.1", gateway.port)
        kept.request("GET", "/healthz")
        kept.getresponse().read()
        open_now = len(os.listdir(f"/proc/{pid}/fd"))
        resource.prlimit(pid, resource.RLIMIT_NOFILE, (open_now, 4096))
        with socket.create_connection(("127.0.0.1", gateway.port)) as late:
            late.sendall(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert "Too many open files" in gateway.wait_for("connection waits")["error"]

            def metrics_inside():
                kept.request("GET", "/metrics")
                return read_metrics(kept.getresponse().read().decode())
            gateway.process.wait_until(lambda: metrics_inside()["rrgate_unaccepted_total"] >= 25)
            metrics = metrics_inside()
            assert metrics["process_open_fds"] == metrics["process_max_fds"] == open_now
            assert is_alive(inside)
            assert len(gateway.events("connection waits")) == 20
            resource.prlimit(pid, resource.RLIMIT_NOFILE, (4096, 4096))
            late.settimeout(5)
            assert late.recv(100).startswith(b"HTTP/1.1 200")
        kept.close()


@pytest.mark.parametrize("jump", [-3600, 7200])
def test_a_clock_that_is_set_is_told_of(device, tmp_path, jump):
    clock = tmp_path / "clock"
    clock.write_text("+0")
    environment = {"LD_PRELOAD": str(FAKETIME), "FAKETIME_TIMESTAMP_FILE": str(clock), "FAKETIME_DONT_FAKE_MONOTONIC": "1",
                   "FAKETIME_CACHE_DURATION": "1"}
    assert FAKETIME.exists()
    with running(tmp_path, {"devices": [{"name": "interop", "url": device}]}, environment) as gateway:
        inside = gateway.session()
        assert gateway.metrics()["rrgate_clock_jumps_total"] == 0
        clock.write_text(f"{jump:+d}")
        assert abs(gateway.wait_for("the clock was set")["by_seconds"] - jump) <= 1
        assert gateway.metrics()["rrgate_clock_jumps_total"] == 1
        assert is_alive(inside)
