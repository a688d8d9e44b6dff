"""A device of the reference implementation that minds credit: experimental.credit, on a free port of the loopback.

Prints one line of JSON when it is ready, {"url": "..."}, and runs until its standard input ends.
"""
import json
import pathlib
import sys

import numpy
import RobotRaconteur as RR

import quiet_node

DEFINITION = pathlib.Path(__file__).parent.parent / "experimental.credit.robdef"
BACKLOG = 8  # packets that are not acknowledged; what is published beyond goes nowhere


class Credit:
    def __init__(self):
        self._orders = 0

    def RRServiceObjectInit(self, context, path):
        self.frames.MaxBacklog = BACKLOG
        self.orders.PipeConnectCallback = self._take

    def publish(self, number, size):
        frame = numpy.zeros((size,), numpy.uint8)
        frame[:4] = numpy.frombuffer(int(number).to_bytes(4, "little"), numpy.uint8)
        self.frames.AsyncSendPacket(frame, lambda: None)

    def _take(self, endpoint):
        def receive(endpoint):
            while endpoint.Available:
                endpoint.ReceivePacket()
                self._orders += 1

        endpoint.PacketReceivedEvent += receive

    def number_of_orders(self):
        return self._orders


if __name__ == "__main__":
    with RR.ServerNodeSetup("credit.service", 0, argv=quiet_node.arguments(server=True)) as setup:
        RR.RobotRaconteurNode.s.RegisterServiceType(DEFINITION.read_text(encoding="ascii"))
        RR.RobotRaconteurNode.s.RegisterService("credit", "experimental.credit.Credit", Credit())
        print(json.dumps({"url": f"rr+tcp://127.0.0.1:{setup.tcp_transport.GetListenPort()}/?service=credit"}), flush=True)
        sys.stdin.buffer.read()
