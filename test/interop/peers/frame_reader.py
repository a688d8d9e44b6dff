"""Reads the pipe `frames` of experimental.credit at a URL, with the reference implementation.

Prints one line of JSON when it is connected, and for each line of its standard input one with the numbers of all frames
that have come so far.
"""
import json
import sys

import RobotRaconteur as RR

import quiet_node


def number_of(frame):
    return int.from_bytes(bytes(frame[:4]), "little")


def main():
    numbers = []

    def receive(endpoint):
        while endpoint.Available:
            numbers.append(number_of(endpoint.ReceivePacket()))

    with RR.ClientNodeSetup(argv=["reader", *(f"--robotraconteur-{name}={value}" for name, value in quiet_node.QUIET.items())]):
        root = RR.RobotRaconteurNode.s.ConnectService(sys.argv[1])
        endpoint = root.frames.Connect(-1)
        endpoint.PacketReceivedEvent += receive
        print(json.dumps("connected"), flush=True)
        for _ in sys.stdin:
            print(json.dumps(list(numbers)), flush=True)


if __name__ == "__main__":
    main()
