"""The test service by the reference implementation: offers experimental.interop on a free port of the loopback.

Prints one line of JSON when it is ready, {"port": N, "url": "..."}, and runs until its standard input ends. Options of
the node (--robotraconteur-...) are handed on; without them discovery and local transports are off.
"""
import json
import pathlib
import sys
import threading

import numpy
import RobotRaconteur as RR

import quiet_node

DEFINITION = pathlib.Path(__file__).parent.parent / "experimental.interop.robdef"
TYPE = "experimental.interop"

ERRORS = {
    "operation_failed": RR.OperationFailedException,
    "invalid_argument": RR.InvalidArgumentException,
    "out_of_range": RR.OutOfRangeException,
    "not_implemented": RR.NotImplementedException,
}


class Part:
    def __init__(self, name, depth=1):
        self.name = name
        self.size = 1.0
        self._inner = Part(name + ".inner", depth - 1) if depth else None

    def identify(self):
        return "part " + self.name

    def get_inner(self):
        if self._inner is None:
            raise RR.ObjectNotFoundException("part " + self.name + " has no inner part")
        return self._inner, TYPE + ".Part"


class SpecialPart(Part):
    def __init__(self, name):
        super().__init__(name)
        self.feature = "none"


class Steps:
    """A generator: `step` makes each value, until the client stops it."""

    def __init__(self, service, step):
        self._service = service
        self._step = step
        self._end = None

    def Next(self, *parameter):
        if self._end == "closed":
            raise RR.StopIterationException("")
        if self._end == "aborted":
            raise RR.OperationAbortedException("aborted")
        return self._step(*parameter)

    def Close(self):
        self._end = self._service.generator_end = "closed"

    def Abort(self):
        self._end = self._service.generator_end = "aborted"


class Interop:
    """Properties that only store are plain attributes; those with a rule are written out below."""

    def __init__(self):
        for name in "double single int8 uint8 int16 uint16 int32 uint32 int64 uint64".split():
            setattr(self, "p_" + name, 0)
        self.p_cdouble = self.p_csingle = 0j
        self.p_bool = False
        self.p_string = ""
        self.p_color = 1
        for name in STORED_OBJECTS:
            setattr(self, "p_" + name, None)
        self.version = "1"
        self.seen_secret = 0.0
        self.seen_target = 0.0
        self.seen_sum = 0.0
        self.collected = []
        self.generator_end = ""
        self.answered = 0.0
        self.answer_error = ""
        self._add_memories()
        self.changed = RR.EventHook()
        self.cleared = RR.EventHook()
        self._head = Part("head")
        self._parts = {index: Part(f"number {index}") for index in (0, 1, 7)}
        self._named = {key: Part(f"named {key}") for key in ("left", "right hand", "left/right", "a.b")}
        self._special = SpecialPart("special")

    def RRServiceObjectInit(self, context, path):
        # By now the wires are there: writeonly ones as receivers, readonly ones as broadcasters.
        self._both = 0.0
        self.target.InValueChanged += self._follow_target
        self.both.WireConnectCallback = self._echo_both
        self.both.PeekInValueCallback = lambda endpoint: 2 * self._both
        self.both.PeekOutValueCallback = lambda endpoint: self._both
        self.both.PokeOutValueCallback = self._poke_both
        self.doubled.PipeConnectCallback = self._double
        self.quick.PipeConnectCallback = self._double
        self.greetings.PipeConnectCallback = self._greet
        self.taken.PipeConnectCallback = self._take
        self.poses.MaxBacklog = 3

    # wires

    def _follow_target(self, value, time, endpoint):
        self.seen_target = value

    def _echo_both(self, connection):
        def echo(wire, value, time):
            self._both = value
            wire.OutValue = 2 * value

        connection.WireValueChanged += echo

    def _poke_both(self, value, time, endpoint):
        self._both = value

    def publish_state(self, value):
        self.state.OutValue = value

    def publish_pose(self, value):
        self.pose.OutValue = value

    # callbacks

    def start_ask(self, question):
        function = self.ask.GetClientFunction(RR.ServerEndpoint.GetCurrentEndpoint())
        self._start(lambda: function(question))

    def start_notice(self, number):
        function = self.notice.GetClientFunction(RR.ServerEndpoint.GetCurrentEndpoint())

        def notice():
            function(number)
            return float(number)

        self._start(notice)

    def _start(self, ask):
        self.answered = 0.0
        self.answer_error = ""

        def work():
            try:
                self.answered = ask()
            except RR.RobotRaconteurException as error:
                self.answer_error = error.errorname

        threading.Thread(target=work, daemon=True).start()

    # pipes

    def _double(self, endpoint):
        def receive(endpoint):
            while endpoint.Available:
                value = endpoint.ReceivePacket()
                if value < 0:
                    return endpoint.Close()
                endpoint.AsyncSendPacket(2 * value, lambda number, error: None)

        endpoint.PacketReceivedEvent += receive

    def _greet(self, endpoint):
        for word in ("hello", "world"):
            endpoint.AsyncSendPacket(word, lambda number, error: None)

    def _take(self, endpoint):
        self.seen_sum = 0.0

        def receive(endpoint):
            while endpoint.Available:
                self.seen_sum += float(numpy.sum(endpoint.ReceivePacket()))

        endpoint.PacketReceivedEvent += receive

    def publish_poses(self, pose, count):
        for number in range(count):
            pose.px = float(number)
            self.poses.AsyncSendPacket(pose, lambda: None)

    # property with a rule

    @property
    def secret(self):
        raise RR.WriteOnlyMemberException("secret is write only")

    @secret.setter
    def secret(self, value):
        self.seen_secret = value

    # functions

    def nothing(self):
        pass

    def add(self, left, right):
        return left + right

    def join(self, words, separator):
        return separator.join(words)

    def shift(self, pose, dx, dy):
        pose.px += dx
        pose.py += dy
        return pose

    def ramp(self, count):
        return numpy.arange(count, dtype=numpy.float64)

    def sum(self, values):
        return float(numpy.sum(values))

    def echo(self, value):
        return value

    def fail(self, kind, text):
        if kind == "custom":
            raise RR.RobotRaconteurNode.s.GetExceptionType(TYPE + ".InteropError")(text)
        raise ERRORS[kind](text)

    # memories

    def _add_memories(self):
        node = RR.RobotRaconteurNode.s
        vector, sample = node.GetNamedArrayDType(TYPE + ".Vector3"), node.GetPodDType(TYPE + ".Sample")

        def vectors(count):
            return node.ArrayToNamedArray(numpy.arange(3.0 * count).reshape((-1, 3)), vector)

        self.m_numbers = RR.ArrayMemory(numpy.arange(100.0))
        self.m_grid = RR.MultiDimArrayMemory(numpy.arange(24, dtype=numpy.int16).reshape((4, 3, 2), order="F"))
        self.m_vectors = RR.ArrayMemory(vectors(5))
        self.m_vector_grid = RR.MultiDimArrayMemory(vectors(6).reshape((2, 3), order="F"))
        self.m_samples = RR.ArrayMemory(numpy.zeros((4,), sample))
        self.m_sample_grid = RR.MultiDimArrayMemory(numpy.zeros((2, 2), sample))
        self.m_fixed = RR.ArrayMemory(numpy.arange(10, dtype=numpy.uint8))
        self.m_large = RR.ArrayMemory(numpy.arange(50000.0))
        self.m_volume = RR.MultiDimArrayMemory(numpy.arange(120000, dtype=numpy.float32).reshape((60, 50, 40), order="F"))

    # generators

    def count_up(self, first, count):
        numbers = iter(range(abs(count)))

        def step():
            for number in numbers:
                return first + number
            if count < 0:
                raise RR.OutOfRangeException("no more")
            raise RR.StopIterationException("")

        return Steps(self, step)

    def walk(self, start, count):
        for _ in range(count):
            start.px += 1
            yield start

    def scale(self, factor):
        return Steps(self, lambda value: factor * value)

    def collect(self):
        self.collected = []

        def step(values):
            self.collected = numpy.concatenate((self.collected, values))

        return Steps(self, step)

    # events

    def fire(self, count):
        for number in range(count):
            self.changed.fire(float(number), f"number {number}")

    def clear(self):
        self.cleared.fire()

    # objects

    def get_head(self):
        return self._head, TYPE + ".Part"

    def get_parts(self, index):
        return self._find(self._parts, int(index))

    def get_named(self, key):
        return self._find(self._named, key)

    def get_anything(self):
        return self._special, TYPE + ".SpecialPart"

    def _find(self, parts, index):
        if index not in parts:
            raise RR.ObjectNotFoundException(f"no part {index!r}")
        return parts[index], TYPE + ".Part"


class Guarded:
    def __init__(self):
        self.level = 1.5
        self.shown = self.quick = self.own = 0.0
        self.status = 7
        self._head = Part("head")
        self._parts = {index: Part(f"number {index}") for index in (1, 10)}

    def RRServiceObjectInit(self, context, path):
        self.position.OutValue = 1.0
        self.free_position.OutValue = 2.0

    def who(self):
        try:
            return RR.ServerEndpoint.GetCurrentAuthenticatedUser().Username
        except RR.RobotRaconteurException:
            return ""

    def touch(self):
        return self.level

    def get_head(self):
        return self._head, TYPE + ".Part"

    def get_parts(self, index):
        return self._parts[int(index)], TYPE + ".Part"


# name, MD5 of the password (secret, hunter2, toor, secret), privileges
USERS = """
alice 5ebe2294ecd0e0f08eab7690d2a6ee69 objectlock
bob 2ab96390c7dbe3439de74d0c9b0b1767 objectlock
root 7b24afc8bc80e548d66c4e7ff72171c5 objectlock,objectlockoverride
guest 5ebe2294ecd0e0f08eab7690d2a6ee69 _
"""


def register_guarded(node):
    users = RR.PasswordFileUserAuthenticator(USERS)
    for name, policies in (("guarded", {"requirevaliduser": "true", "allowobjectlock": "true"}),
                           ("open", {"allowobjectlock": "true"})):
        node.RegisterService(name, TYPE + ".Guarded", Guarded(), RR.ServiceSecurityPolicy(users, policies))


STORED_OBJECTS = """
    doubles singles int8s uint8s int16s uint16s int32s uint32s int64s uint64s cdoubles csingles bools three_doubles
    up_to_four grid two_by_three image pose everything vector vectors vector_grid transform sample samples sample_grid
    double_list string_list array_list pose_list double_map string_map pose_map any any_list any_map
""".split()


def main():
    node = RR.RobotRaconteurNode.s
    with RR.ServerNodeSetup("interop.service", 0, argv=quiet_node.arguments(server=True)) as setup:
        node.RegisterServiceType(DEFINITION.read_text(encoding="ascii"))
        node.RegisterService("interop", TYPE + ".Interop", Interop())
        register_guarded(node)
        port = setup.tcp_transport.GetListenPort()
        print(json.dumps({"port": port, "url": f"rr+tcp://127.0.0.1:{port}/?service=interop"}), flush=True)
        sys.stdin.buffer.read()


if __name__ == "__main__":
    # Its threads do not always let go; the harness has its answer by then.
    threading.excepthook = lambda arguments: print("service thread:", arguments.exc_value, file=sys.stderr)
    main()
