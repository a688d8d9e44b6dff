"""The latency of an empty function call by the Python package, against a raw echo: reference_call.py NAME URL ECHO_PORT"""
import json
import pathlib
import socket
import statistics
import struct
import sys
import time

import RobotRaconteur as RR

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop" / "peers"))

import quiet_node  # noqa: E402

SECONDS = 5
BYTES = 64  # of the echo, about those of a call


def main(name, url, echo_port):
    echo = socket.create_connection(("127.0.0.1", int(echo_port)))
    echo.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    echo.sendall(struct.pack("=II", BYTES, BYTES))

    def yardstick():
        echo.sendall(bytes(BYTES))
        missing = BYTES
        while missing:
            missing -= len(echo.recv(missing))

    with RR.ClientNodeSetup(argv=quiet_node.arguments(server=False)):
        robot = RR.RobotRaconteurNode.s.ConnectService(url)
        for _ in range(500):
            robot.nothing()
            yardstick()
        samples = {"ours": [], "yardstick": []}
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            for work, times in ((robot.nothing, samples["ours"]), (yardstick, samples["yardstick"])):
                begin = time.perf_counter_ns()
                work()
                times.append(time.perf_counter_ns() - begin)
        RR.RobotRaconteurNode.s.DisconnectService(robot)
    print(json.dumps({"name": f"call, {name}", "rounds": len(samples["ours"]),
                      **{who: figures(sorted(times)) for who, times in samples.items()}}), flush=True)


def figures(times):
    most = times[:len(times) - len(times) // 100]
    return {"min": times[0], "p50": times[len(times) // 2], "p99": most[-1], "mean": statistics.fmean(most)}


if __name__ == "__main__":
    main(*sys.argv[1:])
