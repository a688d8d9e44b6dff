"""A device by the reference implementation that does what it is asked for, but whose answers can't be read, or don't come.

    odd_answers.py PORT

It prints a line for each thing that it does.
"""
import sys
import threading

import quiet_node
import RobotRaconteur as RR

DEFINITION = """
service experimental.odd

stdver 0.10

object Odd
    function string move(double to)
    property string place [readonly]
    function string{generator} moves()
    function double{generator} wait()
end
"""
NO_STRING = None


def say(line):
    print(line, flush=True)


class Moves:
    def Next(self):
        say("step")
        return NO_STRING

    def Close(self):
        say("closed")


class Waiting:
    """Its first value does not come before it is closed."""

    def __init__(self):
        self._closed = threading.Event()

    def Next(self):
        say("step")
        self._closed.wait()
        raise RR.StopIterationException("")

    def Close(self):
        say("closed")
        self._closed.set()


class Odd:
    place = NO_STRING

    def move(self, to):
        say(f"moved to {to}")
        return NO_STRING

    def moves(self):
        return Moves()

    def wait(self):
        return Waiting()


port = int(sys.argv[1])
with RR.ServerNodeSetup("experimental.odd", port, argv=quiet_node.arguments(server=True)):
    RR.RobotRaconteurNode.s.RegisterServiceType(DEFINITION)
    RR.RobotRaconteurNode.s.RegisterService("odd", "experimental.odd.Odd", Odd())
    say("ready")
    threading.Event().wait()
