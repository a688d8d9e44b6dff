"""A client of the reference implementation for chaos.py: calls, sends packets and follows the wire of experimental.chaos, and
connects anew whenever it has lost its connection.

    chaos_client.py URL FIRST_TOKEN

Prints lines of JSON: {"answered": token}, {"echoed": count}, {"value": value}, {"broken": what must not be}.
"""
import contextlib
import json
import os
import sys
import threading
import time

import RobotRaconteur as RR

import quiet_node


def say(**what):
    os.write(1, json.dumps(what).encode() + b"\n")  # of any thread: in one go


class Echo:
    """What comes back of what one endpoint was sent."""

    def __init__(self, endpoint):
        self.endpoint = endpoint
        self.sent = self.received = 0
        self._reading = threading.Lock()
        endpoint.PacketReceivedEvent += self._read

    def _read(self, endpoint):
        with self._reading:  # callbacks of the package may run side by side
            while endpoint.Available:
                value = endpoint.ReceivePacket()
                self.received += 1
                if value != self.received:
                    say(broken=f"packet {value:.0f} of an endpoint came as number {self.received}")
                if self.received % 20 == 0:
                    say(echoed=20)

    def send(self):
        self.sent += 1
        self.endpoint.SendPacket(float(self.sent))


def work(root, tokens):
    wire = root.value.Connect()
    wire.WireValueChanged += lambda wire, value, time: say(value=value)
    echo = Echo(root.echo.Connect(-1))
    while True:
        for _ in range(10):
            echo.send()
            time.sleep(0.01)
        token = next(tokens)
        answer = root.once(token)
        say(answered=answer) if answer == token else say(broken=f"call {token} was given the answer {answer}")


@contextlib.contextmanager
def until_lost():
    """Ends with the connection. While a member is connected, the package knows no more of that than "std::exception"."""
    try:
        yield
    except Exception as error:
        if not isinstance(error, (RR.RobotRaconteurException, RuntimeError)) and str(error) != "std::exception":
            raise
        print(error, file=sys.stderr, flush=True)


def main():
    url, first = sys.argv[1], int(sys.argv[2])
    tokens = iter(range(first, first + 1_000_000))
    node = RR.RobotRaconteurNode.s
    with RR.ClientNodeSetup(argv=quiet_node.arguments(server=False)):
        node.RequestTimeout = 5
        while True:
            try:
                root = node.ConnectService(url)
            except RR.RobotRaconteurException:
                time.sleep(0.2)
                continue
            with until_lost():
                work(root, tokens)
            with until_lost():
                node.DisconnectService(root)


if __name__ == "__main__":
    main()
