"""A device of the real package with a memory of 80,000 pods: more than one request may read.

many_samples.py
"""
import json
import sys

import numpy
import RobotRaconteur as RR

import quiet_node

DEFINITION = """service experimental.many
stdver 0.10
pod Sample
    field int32 id
    field double[16] reading
end
object Device
    memory Sample[] samples [readonly]
end
"""


class Device:
    def __init__(self):
        self.samples = RR.ArrayMemory(numpy.zeros((80_000,), RR.RobotRaconteurNode.s.GetPodDType("experimental.many.Sample")))


if __name__ == "__main__":
    with RR.ServerNodeSetup("experimental.many_samples", 0,
                            argv=[f"--robotraconteur-{name}={value}" for name, value in quiet_node.QUIET.items()]) as setup:
        RR.RobotRaconteurNode.s.RegisterServiceType(DEFINITION)
        RR.RobotRaconteurNode.s.RegisterService("device", "experimental.many.Device", Device())
        print(json.dumps({"url": f"rr+tcp://127.0.0.1:{setup.tcp_transport.GetListenPort()}/?service=device"}), flush=True)
        sys.stdin.read()
