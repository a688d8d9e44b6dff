"""The Python package's row of the latency table: reference_client.py URL; it does what answer_counts() of latency.hpp does."""
import array
import pathlib
import sys
import time

import RobotRaconteur as RR

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "interop" / "peers"))

import quiet_node  # noqa: E402


def main(url):
    with RR.ClientNodeSetup(argv=quiet_node.arguments(server=False)):
        robot = RR.RobotRaconteurNode.s.ConnectService(url)
        for _ in range(1000):
            robot.nothing()
        print("ready", flush=True)
        for line in sys.stdin:
            samples = array.array("I")
            for _ in range(int(line)):
                begin = time.perf_counter_ns()
                robot.nothing()
                samples.append(time.perf_counter_ns() - begin)
            sys.stdout.buffer.write(samples.tobytes())
            sys.stdout.buffer.flush()
        RR.RobotRaconteurNode.s.DisconnectService(robot)


if __name__ == "__main__":
    main(*sys.argv[1:])
