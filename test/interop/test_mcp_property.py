"""Whatever an agent asks for, in whatever order and by whatever way: nothing reaches the device that no rule gives, that lies outside
its limits, that a person would have had to allow, or that needs a lease which somebody else has. What the device was told is the truth."""
import concurrent.futures
import json
import random
import threading

import pytest

from agents import serving, with_tokens
from command_line import REFUSED, Ran
from http_api import ask
from json_sockets import Socket
from leases import wait_for
from processes import start_gateway

TYPE = "experimental.scripted"
DEFINITION = f"""service {TYPE}
stdver 0.10
struct Order
    field double speed
    field string how
end
object Robot
    property double speed
    property double power
    function void go(Order order)
    function double turn(double angle)
    function void reset()
    wire double target [writeonly]
    pipe double path [writeonly]
end
"""
AGENT = {"roles": ["agent"], "devices": ["interop"], "paths": ["robot"]}
RULES = [
    {**AGENT, "members": ["speed"], "may": ["write"], "agent": {"limits": {"speed": [0, 2]}, "approval": "none", "hold_seconds": 0}},
    {**AGENT, "members": ["go"], "may": ["call"], "agent": {"limits": {"order.speed": [0, 0.5]}, "lease": False}},
    {**AGENT, "members": ["turn"], "may": ["call"],
     "agent": {"limits": {"angle": [-1, 1]}, "approval": "none", "lease": False}},
]
LEASES = {"members": [{"member": "robot.speed", "lease": "required"}], "safe": [{"property": "robot.speed", "value": 0}],
          "takeover": ["admin"]}
HTTP = "/api/v1/devices/interop/robot"
APPROVALS = "/api/v1/agents/approvals"
NUMBERS = [0, 0.25, 0.5, 1, 2, 2.0000001, -1, -0.5, 7, 1e308, -0.0, "1", "NaN", "Infinity", True, None, [1], {"speed": 1}]
ORDERS = [{"speed": number, "how": how} for number in NUMBERS for how in ("", "fast")] + [{}, None, {"speed": 0.1}, [0.1]]
ARGUMENTS = [{"order": order} for order in ORDERS] + [{"angle": number} for number in NUMBERS] + \
    [{}, {"angle": 0.5, "more": 1}, {"order": {"speed": 0.1, "how": "", "more": 9}}, {"speed": 1}, [], None]
RIGHT = {"speed": ("set", NUMBERS), "power": ("set", NUMBERS), "turn": ("call", [{"angle": number} for number in NUMBERS]),
         "go": ("call", [{"order": order} for order in ORDERS]), "reset": ("call", [{}])}
EVERYTHING = {"speed", "turn", "go"}  # that a rule gives
MEMBERS = ["speed", "power", "go", "turn", "reset", "target", "path", "", "nothing", "speed/0", "go/go"]


class Robot:
    """Notes whatever reaches it."""

    def __init__(self):
        self.told, self._speed, self._power, self._lock = [], 0.0, 0.0, threading.Lock()

    def RRServiceObjectInit(self, context, path):
        self.target.InValueChanged += lambda value, time, endpoint: self.note("target", value)
        self.path.PipeConnectCallback = lambda endpoint: endpoint.PacketReceivedEvent.__iadd__(
            lambda packets: self.note("path", packets.ReceivePacket()))

    def note(self, member, value):
        with self._lock:
            self.told.append((member, value))

    @property
    def speed(self):
        return self._speed

    @speed.setter
    def speed(self, value):
        self.note("speed", value)
        self._speed = value

    @property
    def power(self):
        return self._power

    @power.setter
    def power(self, value):
        self.note("power", value)
        self._power = value

    def go(self, order):
        self.note("go", (order.speed, order.how))

    def turn(self, angle):
        self.note("turn", angle)
        return angle

    def reset(self):
        self.note("reset", None)


class Course:
    """An agent that asks for anything, and a person who sometimes looks."""

    def __init__(self, seed, port, robot, agent, admin, pool):
        self.random, self.port, self.robot, self.agent, self.admin, self.pool = random.Random(seed), port, robot, agent, admin, pool
        self.allowed = []  # what a person has allowed, once each
        self.person = None  # who has the lease
        self.checked = 0  # of what the robot was told
        self.seen_members = set()

    def mcp(self, name, arguments):
        message = {"jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": {"name": name, "arguments": arguments}}
        return ask(self.port, "POST", "/mcp", message, self.agent)

    def command(self):
        pick = self.random.choice
        tool, member = pick(["call", "set"]), pick(MEMBERS)
        values = {"args": pick(ARGUMENTS), "value": pick(NUMBERS + ORDERS)}
        if member in RIGHT and self.random.random() < 0.8:  # what the member could take, were it allowed
            tool, given = RIGHT[member]
            values = dict.fromkeys(values, pick(given))
        arguments = {"device": pick(["interop"] * 9 + ["other"]), "path": f"robot/{member}".rstrip("/"), "why": "to see"}
        arguments |= {"args": values["args"]} if tool == "call" else {"value": values["value"]}
        if self.random.random() < 0.1:
            arguments["dry_run"] = pick([True, False, "yes"])
        return lambda: self.mcp(tool, arguments)

    def by_rest(self):
        pick = self.random.choice
        method, query = pick(["PUT", "POST"]), pick(["", "", "?lease=acquire&deadman=1000", "?lease=take&deadman=1000", "?lock=user"])
        path, body = f"{HTTP}/{pick(MEMBERS)}{query}", pick(NUMBERS + ARGUMENTS)
        return lambda: ask(self.port, method, path, body, self.agent)

    def by_socket(self):
        pick = self.random.choice
        requests = [(pick(["set", "call", "send", "poke", "lock", "lease", "connect", "write", "open", "release"]), pick(MEMBERS),
                     {"value": pick(NUMBERS + ORDERS), "args": pick(ARGUMENTS), "deadman": 1000, "takeover": pick([True, False])})
                    for _ in range(4)]

        def work():
            with Socket(self.port, HTTP, additional_headers=self.agent) as socket:
                for op, path, more in requests:
                    assert "error" in socket.next(id=socket.send(op, path, **more)), (op, path, more)

        return work

    def by_command_line(self):
        """A client that speaks Robot Raconteur through the gateway's WebSocket, with the agent's token."""
        pick = self.random.choice
        member = pick(["speed", "power", "go", "turn", "reset"])
        value = pick([number for number in NUMBERS if isinstance(number, float)])
        given = ["set", member, str(value)] if member in ("speed", "power") else \
            ["call", member, *{"go": [json.dumps(pick(ORDERS[:4]))], "turn": [str(value)], "reset": []}[member]]
        url = f"http://127.0.0.1:{self.port}/devices/interop?service=robot"
        token = {"RRGATE_TOKEN": self.agent["Authorization"].split()[1]}

        def work():
            ran = Ran([given[0], url, *given[1:]], environment=token)
            assert ran.code == REFUSED, (given, ran.code, ran.error)

        return work

    def rights(self):
        pick = self.random.choice
        path = pick([f"{APPROVALS}/{each['id']}" for each in self.waiting()] + ["/api/v1/agents/stop", f"{APPROVALS}/1"])
        return lambda: ask(self.port, "POST", path, pick([{"answer": "once"}, {"answer": "minutes", "minutes": 5}, {"minutes": 0}]), self.agent)

    def others(self):
        tool = self.random.choice(["read", "describe", "stop", "watch"])
        arguments = {"device": "interop", "path": f"robot/{self.random.choice(MEMBERS)}".rstrip("/")}
        return lambda: self.mcp(tool, {**arguments, **({"seconds": 0.01} if tool == "watch" else {})})

    def waiting(self):
        return ask(self.port, "GET", APPROVALS, headers=self.admin).json["approvals"]

    def look(self):
        """The person answers what waits, or not."""
        for each in self.waiting():
            answer = self.random.choice(["once", "deny", "", ""])
            if not answer:
                continue
            taken = ask(self.port, "POST", f"{APPROVALS}/{each['id']}", {"answer": answer}, self.admin).status < 300
            if taken and answer == "once":
                self.allowed.append(each["values"]["order"]["speed"])

    def command_oneself(self, socket):
        """The person takes the lease, or gives it back."""
        if self.person:
            socket.ask("release")
        else:
            socket.ask("lease", deadman=60000, takeover=True)
            with self.robot._lock:
                self.checked = len(self.robot.told)
        self.person = None if self.person else socket

    def check(self):
        with self.robot._lock:
            told = self.robot.told[self.checked:]
            self.checked = len(self.robot.told)
        for member, value in told:
            if (member, value) != ("speed", 0):
                self.seen_members.add(member)
            assert not self.person or (member, value) == ("speed", 0), ("somebody else has the lease", member, value)
            if member == "speed":
                assert 0 <= value <= 2
            elif member == "turn":
                assert -1 <= value <= 1
            elif member == "go":
                self.allowed.remove(value[0])  # nobody has allowed it: ValueError
                assert 0 <= value[0] <= 0.5
            else:
                raise AssertionError(f"no rule gives {member}: {value}")

    def run(self, steps):
        with Socket(self.port, HTTP, additional_headers=self.admin) as socket:
            for _ in range(steps):
                kinds = self.random.choices([self.command, self.by_rest, self.by_socket, self.by_command_line, self.rights, self.others], [12, 4, 1, 1, 2, 3],
                                            k=self.random.randrange(1, 4))
                asking = [self.pool.submit(kind()) for kind in kinds]
                while not all(each.done() for each in asking):
                    self.look()
                    concurrent.futures.wait(asking, 0.01)
                for each in asking:
                    each.result()
                self.check()
                if self.random.random() < 0.1:
                    self.command_oneself(socket)
            if self.person:
                self.command_oneself(socket)


@pytest.mark.parametrize("seed", range(3))
def test_no_course_of_requests_moves_a_device_but_on_the_terms_of_its_rules(node, tmp_path, seed):
    config, agent, admin = with_tokens(tmp_path, *RULES)
    config["mcp"] = {"longest_approval_ms": 1000}
    robot = Robot()
    with serving(DEFINITION, TYPE + ".Robot", robot) as url:
        gateway, port = start_gateway(tmp_path, url, device={"mode": "shared", "leases": LEASES}, **config)
        try:
            with concurrent.futures.ThreadPoolExecutor(4) as pool:
                course = Course(seed, port, robot, agent, admin, pool)
                course.run(1000)
                for _ in range(4):  # chance may have left one out
                    if course.seen_members != EVERYTHING:
                        course.run(500)
            wait_for(lambda: robot.speed == 0)  # whoever has moved it, and by whatever its lease has ended
            course.check()
        finally:
            gateway.stop()
    # It is no test of an agent that gets nowhere.
    assert course.seen_members == EVERYTHING
