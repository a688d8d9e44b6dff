#!/usr/bin/env python3
"""The latency of an empty call, by every way there is: paper.py --build DIRECTORY --report FILE [--calls N]

What the paper has as its Table I. All clients run beside their services at once and take turns, a twentieth of their calls each, so
that the machine's moods hit all alike. Writes a table (Markdown) and, beside it, a picture of how the latencies are spread (SVG).
"""
import argparse
import array
import contextlib
import json
import os
import pathlib
import platform
import shutil
import statistics
import sys
import tempfile
from dataclasses import dataclass

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parents[1] / "interop")]

import spread  # noqa: E402
from calls import CORES, on  # noqa: E402
from processes import ROOT, Background, free_port  # noqa: E402
from relay import gateway, listening  # noqa: E402

TURNS = 20
REQUEST, REPLY = 54, 54  # bytes of an empty call over TCP in the steady state, and of its reply
SERVICE = "11111111-0000-4000-8000-000000000001"
CLIENT = "22222222-0000-4000-8000-000000000002"


@dataclass
class Way:
    name: str
    command: list
    environment: dict
    share: float = 1.0  # of the calls: less where each takes long


class Client:
    """A process that makes calls when it is told to, and says how long each took."""

    def __init__(self, way, folder, calls):
        self.way, self.samples = way, array.array("I")
        self._calls = max(1, int(calls * way.share) // TURNS)
        self._process = Background(on(CORES[0], *way.command), folder / f"{way.name}.log".replace("/", "_"), way.environment)
        try:
            assert self._process.next_line() == "ready"
        except BaseException:
            self._process.stop()
            raise

    def take_turn(self):
        pipes = self._process.process
        pipes.stdin.write(f"{self._calls}\n".encode())
        pipes.stdin.flush()
        wanted, taken = 4 * self._calls, b""
        while len(taken) < wanted:
            piece = os.read(pipes.stdout.fileno(), wanted - len(taken))
            assert piece, f"{self.way.name}: the client has ended: {self._process.description()}"
            taken += piece
        self.samples.frombytes(taken)

    def stop(self):
        self._process.stop()


def start(stack, folder, name, *command, environment={}):
    """What the first line of a process says, which runs on the other core."""
    process = Background(on(CORES[-1], *command), folder / f"{name}.log", environment)
    stack.callback(process.stop)
    return json.loads(process.next_line())


def ways(build, folder, stack):
    """All ways whose programs this machine has; why not the others."""
    client = build / "test/bench/latency_client"
    peers = HERE.parents[1] / "interop" / "peers"
    lab = folder / "lab"
    Background([build / "test/interop/cpp/rr-test-certificates", lab, "{%s}" % SERVICE, "{%s}" % CLIENT], folder / "lab.log").process.wait(30)
    good = str(lab / "good")
    secure = {"ROBOTRACONTEUR_SSL_CERT_FILE": str(lab / "ca.pem"), "ROBOTRACONTEUR_SYSTEM_CONFIG_DIR": good,
              "ROBOTRACONTEUR_USER_CONFIG_DIR": good}
    options = [f"--robotraconteur-nodeid={SERVICE}", "--robotraconteur-load-tls=true"]
    echo = start(stack, folder, "echo", build / "test/bench/bench_peer", "echo")["port"]
    local_echo = folder / "echo.socket"
    start(stack, folder, "local echo", build / "test/bench/bench_peer", "echo", local_echo)
    port = start(stack, folder, "service", build / "test/interop/cpp/rr-test-service", *options, environment=secure)["port"]
    start(stack, folder, "local service", build / "test/interop/cpp/rr-test-service", "--robotraconteur-local-enable=true")
    reference = start(stack, folder, "reference", sys.executable, peers / "service.py")["port"]
    node = f"nodeid={SERVICE}&service=interop"

    def way(name, *command, share=1.0):
        return Way(name, command, secure, share)

    def call(name, url, share=1.0):
        return way(name, client, "call", url, share=share)

    yield way("raw echo, local socket", client, "echo", local_echo, REQUEST, REPLY)
    yield way("raw echo, TCP", client, "echo", echo, REQUEST, REPLY)
    yield way("rr+intra", client, "intra")
    yield call("rr+local", "rr+local:///?nodename=interop.service&service=interop")
    yield call("rr+tcp", f"rr+tcp://127.0.0.1:{port}/?{node}")
    yield call("rrs+tcp (TLS 1.3)", f"rrs+tcp://127.0.0.1:{port}/?{node}")
    yield call("rr+ws", f"rr+ws://127.0.0.1:{port}/?{node}")
    yield call("rrs+ws (TLS 1.3)", f"rrs+ws://127.0.0.1:{port}/?{node}")
    for mode in ("relay", "shared"):
        gate = stack.enter_context(gateway(build, port, mode=mode))
        yield call(f"rr+tcp through rrgate ({mode})", f"rr+tcp://127.0.0.1:{gate}/?nodename=device&service=interop"
                   if mode == "shared" else f"rr+tcp://127.0.0.1:{gate}/?nodeid={SERVICE}&service=interop")
        yield call(f"rr+ws through rrgate ({mode})", f"rr+ws://127.0.0.1:{gate}/devices/device?service=interop")
    python = [sys.executable, HERE / "reference_client.py"]
    yield call("rr+tcp, service of RobotRaconteur 1.2.8 (Python)", f"rr+tcp://127.0.0.1:{reference}/?service=interop", share=0.2)
    yield way("rr+tcp, client of RobotRaconteur 1.2.8 (Python)", *python, f"rr+tcp://127.0.0.1:{port}/?{node}", share=0.2)
    yield way("rr+tcp, client and service of RobotRaconteur 1.2.8 (Python)", *python, f"rr+tcp://127.0.0.1:{reference}/?service=interop",
              share=0.2)
    server = shutil.which("nats-server", path=f"{ROOT / 'build/deps/proxies/usr/sbin'}:{os.environ['PATH']}")
    if server:
        nats = free_port()
        stack.enter_context(listening(nats, *on(CORES[-1], server, "-a", "127.0.0.1", "-p", nats)))
        start(stack, folder, "nats service", client, "nats-service", nats)
        yield way("NATS, request and reply through nats-server", client, "nats", nats)
    grpc = build / "test/bench/latency_grpc"
    if grpc.exists():
        yield way("gRPC, synchronous, no TLS", grpc, "call", start(stack, folder, "grpc", grpc, "service")["port"])


def measure(build, calls):
    with tempfile.TemporaryDirectory() as scratch, contextlib.ExitStack() as stack:
        folder = pathlib.Path(scratch)
        clients = []
        for each in ways(build, folder, stack):
            clients.append(Client(each, folder, calls))
            stack.callback(clients[-1].stop)
        for _ in range(TURNS):
            for client in clients:
                client.take_turn()
        return {client.way.name: sorted(sample / 1000 for sample in client.samples) for client in clients}


def figures(times):
    return {"mean": statistics.fmean(times), "sigma": statistics.pstdev(times), "min": times[0], "p50": times[len(times) // 2],
            "p99": times[len(times) * 99 // 100], "max": times[-1]}


def machine():
    model = next((line.split(":", 1)[1].strip() for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines()
                  if line.startswith("model name")), platform.machine())
    return f"{model}, {os.cpu_count()} processors, Linux {platform.release()}"


def table(results):
    yardstick = {kind: figures(results[f"raw echo, {kind}"])["p50"] for kind in ("TCP", "local socket")}
    lines = [f"Microseconds, on {machine()}; clients run on processor {CORES[0]}, services on {CORES[-1]}. The last column is the",
             "median, as a multiple of the raw echo's over TCP; of a local socket's for `rr+local`.", "",
             "| way | calls | mean | σ | min | p50 | p99 | max | to the raw echo |", "|---|---:|---:|---:|---:|---:|---:|---:|---:|"]
    for name, times in results.items():
        of = figures(times)
        ratio = of["p50"] / yardstick["local socket" if "local" in name else "TCP"]
        lines.append(f"| {name} | {len(times):,} | " + " | ".join(f"{of[kind]:.1f}" for kind in ("mean", "sigma", "min", "p50", "p99", "max"))
                     + f" | {ratio:.2f} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--report", type=pathlib.Path, required=True)
    parser.add_argument("--calls", type=int, default=100_000, help="by each way (default: 100000; those through Python a fifth)")
    arguments = parser.parse_args()
    os.environ["RR_BUILD"] = str(arguments.build.resolve())
    results = measure(arguments.build.resolve(), arguments.calls)
    arguments.report.parent.mkdir(parents=True, exist_ok=True)
    picture = arguments.report.with_suffix(".svg")
    picture.write_text(spread.draw(results), encoding="utf-8")
    text = table(results)
    arguments.report.write_text(f"# The latency of an empty call\n\n{text}\n![How the latencies are spread]({picture.name})\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
