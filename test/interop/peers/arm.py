"""A device of the reference implementation that several clients want for themselves: experimental.arm, on a free port of
the loopback or --robotraconteur-tcp-port.

Its services are the same arm: "guarded" is for users alone, at "open" one may log in, "plain" knows no users.

Prints one line of JSON when it is ready, {"url": "..."}, and runs until its standard input ends.
"""
import json
import pathlib
import sys
import threading

import RobotRaconteur as RR

import quiet_node

DEFINITION = pathlib.Path(__file__).parent.parent / "experimental.arm.robdef"
TYPE = "experimental.arm"

# name, MD5 of the password (secret for all of them), privileges
USERS = """
gateway 5ebe2294ecd0e0f08eab7690d2a6ee69 objectlock
alice 5ebe2294ecd0e0f08eab7690d2a6ee69 objectlock
bob 5ebe2294ecd0e0f08eab7690d2a6ee69 objectlock
"""


class Tool:
    def __init__(self, arm):
        self.opening = 0.0
        self._arm = arm

    def hold(self):
        self._arm.move(0.0)


class Arm:
    def __init__(self):
        self.speed = self.shown = self.seen_target = 0.0
        self.status = 0
        self._tool = Tool(self)
        self._tools = {0: Tool(self), 1: Tool(self)}
        self._changed = threading.Condition()
        self.moving = self.sessions = 0
        self.answered = ""
        self._finished = 0

    def RRServiceObjectInit(self, context, path):
        self.target.InValueChanged += self._follow_target
        self.state.OutValue = 1.0

    def count_sessions(self, context, event, parameter):
        if event == RR.ServerServiceListenerEventType_ClientConnected:
            self.sessions += 1
        elif event == RR.ServerServiceListenerEventType_ClientDisconnected:
            self.sessions -= 1

    def _follow_target(self, value, time, endpoint):
        self.seen_target = value

    def move(self, position):
        with self._changed:
            self.moving += 1
            number = self._finished
            self._changed.wait_for(lambda: self._finished > number)
            self.moving -= 1
        return position

    def finish(self):
        with self._changed:
            self._finished += 1
            self._changed.notify_all()

    def ask(self, question):
        return self.confirm.GetClientFunction(RR.ServerEndpoint.GetCurrentEndpoint())(question)

    def ask_later(self, question):
        function = self.confirm.GetClientFunction(RR.ServerEndpoint.GetCurrentEndpoint())
        self.answered = ""

        def ask():
            try:
                self.answered = function(question)
            except RR.RobotRaconteurException as error:
                self.answered = error.errorname

        threading.Thread(target=ask, daemon=True).start()

    def who(self):
        try:
            return RR.ServerEndpoint.GetCurrentAuthenticatedUser().Username
        except RR.RobotRaconteurException:
            return ""

    def get_tool(self):
        return self._tool, TYPE + ".Tool"

    def get_tools(self, index):
        return self._tools[int(index)], TYPE + ".Tool"


def serve(name, *policy):
    arm = Arm()
    RR.RobotRaconteurNode.s.RegisterService(name, TYPE + ".Arm", arm, *policy).AddServerServiceListener(arm.count_sessions)


def main():
    node = RR.RobotRaconteurNode.s
    with RR.ServerNodeSetup("arm.device", 0, argv=quiet_node.arguments(server=True)) as setup:
        node.RegisterServiceType(DEFINITION.read_text(encoding="ascii"))
        users = RR.PasswordFileUserAuthenticator(USERS)
        for name, policies in (("guarded", {"requirevaliduser": "true", "allowobjectlock": "true"}),
                               ("open", {"allowobjectlock": "true"})):
            serve(name, RR.ServiceSecurityPolicy(users, policies))
        serve("plain")
        print(json.dumps({"url": f"rr+tcp://127.0.0.1:{setup.tcp_transport.GetListenPort()}/?service=plain"}), flush=True)
        sys.stdin.buffer.read()


if __name__ == "__main__":
    # Its threads do not always let go; the harness has its answer by then.
    threading.excepthook = lambda arguments: print("device thread:", arguments.exc_value, file=sys.stderr)
    main()
