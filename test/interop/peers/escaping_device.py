"""A device whose texts have escape sequences of terminals in them.

    escaping_device.py PORT
"""
import sys
import threading

import quiet_node
import RobotRaconteur as RR

DEFINITION = """
service experimental.escaping

stdver 0.10

object Thing
    property string text [readonly]
    function void fail()
end
"""


class Thing:
    text = "a\tb\n\x1b[31mc\x9b31md"

    def fail(self):
        raise RuntimeError("\x1b[31mwrong")


port = int(sys.argv[1])
with RR.ServerNodeSetup("experimental.escaping", port, argv=quiet_node.arguments(server=True)):
    RR.RobotRaconteurNode.s.RegisterServiceType(DEFINITION)
    RR.RobotRaconteurNode.s.RegisterService("evil", "experimental.escaping.Thing", Thing())
    print("ready", flush=True)
    threading.Event().wait()
