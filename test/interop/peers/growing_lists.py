"""A device of the real package whose pipe sends each client an empty list, one of two numbers and one of three.

growing_lists.py PORT
"""
import sys

import RobotRaconteur as RR

import quiet_node

DEFINITION = """service experimental.growing
stdver 0.10
object Device
    pipe double[] lists
end
"""


class Device:
    def RRServiceObjectInit(self, context, path):
        self.lists.PipeConnectCallback = self._send

    def _send(self, endpoint):
        for numbers in [], [1.5, 2.5], [3.5, 4.5, 5.5]:
            endpoint.AsyncSendPacket(numbers, lambda number, error: None)


if __name__ == "__main__":
    with RR.ServerNodeSetup("experimental.growing_lists", int(sys.argv[1]),
                            argv=[f"--robotraconteur-{name}={value}" for name, value in quiet_node.QUIET.items()]):
        RR.RobotRaconteurNode.s.RegisterServiceType(DEFINITION)
        RR.RobotRaconteurNode.s.RegisterService("device", "experimental.growing.Device", Device())
        print("ready", flush=True)
        sys.stdin.read()
