#!/usr/bin/env python3
"""What agents cost: a call by the Model Context Protocol beside the same by REST, and what an idle client holds. Prints results as
lines of JSON: agents.py --build DIRECTORY. One client at a time, over connections that stay open."""
import argparse
import http.client
import json
import pathlib
import statistics
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop"))

import relay  # noqa: E402
from processes import free_port  # noqa: E402

NAME = "agent's call by /mcp, beside REST"
CALLS = 2000
CLIENTS = 100
REST = "/api/v1/devices/device/interop/add"
ARGUMENTS = {"left": 1, "right": 2}
RULES = [{"roles": ["agent"], "may": ["read", "call"]},
         {"roles": ["agent"], "may": ["call"], "agent": {"approval": "none", "lease": False}}]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    build = parser.parse_args().build
    with relay.device(build) as device, tempfile.TemporaryDirectory() as scratch:
        port, config = free_port(), pathlib.Path(scratch) / "gateway.json"
        url = f"rr+tcp://127.0.0.1:{device}/?service=interop"
        config.write_text(json.dumps({
            "listen": [f"127.0.0.1:{port}"], "devices": [{"name": "device", "url": url, "mode": "shared"}], "mcp": {},
            "log": {"level": "error"}, "access": {"anonymous_role": "agent", "rules": RULES}}))
        with relay.listening(port, build / "server/rrgate", "serve", "--config", config) as process:
            message = {"jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": {"name": "call", "arguments": {
                "device": "device", "path": "interop/add", "args": ARGUMENTS, "why": "to see how long it takes"}}}
            by_rest, by_mcp = asker(port, REST, ARGUMENTS), asker(port, "/mcp", message)
            assert b"error" not in by_mcp() and json.loads(by_rest()) == {"result": 3}
            times = {by_rest: [], by_mcp: []}
            for _ in range(CALLS):  # in turn: both have the same weather
                for each, taken in times.items():
                    begin = time.perf_counter_ns()
                    each()
                    taken.append(time.perf_counter_ns() - begin)
            print(json.dumps({"name": NAME, "ours": figures(times[by_mcp][100:]), "yardstick": figures(times[by_rest][100:])}))
            print(json.dumps({"name": "memory, idle agent", "bytes": idle_bytes(port, process)}))


def asker(port, path, body):
    """Asks over a connection of its own. Calls wait for their answer once."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    text, headers = json.dumps(body), {"Content-Type": "application/json", "Accept": "application/json, text/event-stream"}

    def ask():
        connection.request("POST", path, text, headers)
        response = connection.getresponse()
        content = response.read()
        assert response.status == 200, content
        return content

    return ask


def figures(times):
    cuts = statistics.quantiles(times, n=100)
    return {"min": min(times), "p50": statistics.median(times), "p99": cuts[98], "mean": statistics.fmean(times)}


def idle_bytes(port, process):
    """What a client costs that has begun, listed the tools, and stays connected, with a stream that tells it of changes."""
    messages = [{"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {"protocolVersion": "2025-11-25"}},
                {"jsonrpc": "2.0", "id": 2, "method": "tools/list"}]
    held = []

    def add(count):
        for _ in range(count):
            connection, stream = (http.client.HTTPConnection("127.0.0.1", port, timeout=20) for _ in range(2))
            headers = {"Content-Type": "application/json"}
            for message in messages:
                connection.request("POST", "/mcp", json.dumps(message), headers)
                response = connection.getresponse()
                headers |= {name: value for name, value in response.headers.items() if name == "Mcp-Session-Id"}
                assert b"error" not in response.read()
            stream.request("GET", "/mcp", headers=headers)
            response = stream.getresponse()
            assert response.status == 200
            held.append((connection, stream, response))

    add(20)  # what the first ones need is there then
    before = resident_bytes(process)
    add(CLIENTS)
    return (resident_bytes(process) - before) / CLIENTS


def resident_bytes(process):
    status = pathlib.Path(f"/proc/{process}/status").read_text(encoding="ascii")
    return int(status.split("VmRSS:")[1].split()[0]) * 1024


if __name__ == "__main__":
    main()
