"""The test client by the reference implementation: carries out the steps of one scenario (README.md, "Steps").

client.py URL [--robotraconteur-...]    reads {"steps": [...]} from standard input, prints {"results": [...]}
"""
import json
import sys
import threading
import time

import numpy
import RobotRaconteur as RR

import quiet_node
from values import Values, plain

NO_VERBS = ("by", "on", "value", "args", "count", "until", "digest", "service", "username", "password", "timeout",
            "as", "index", "values", "fail", "of", "position", "size")
PATIENCE = 10.0  # seconds for anything that has to come by itself


class Client:
    def __init__(self, url):
        self._url = url
        self._root = RR.RobotRaconteurNode.s.ConnectService(url)
        self._others = {}  # roots of further clients, by name
        self._values = Values(self._root)
        self._news = threading.Condition()
        self._events = {}
        self._wires = {}
        self._pipes = {}
        self._generators = {}
        self._callbacks = {}

    def carry_out(self, step):
        target = self._others[step["by"]] if "by" in step else self._root
        for part in step.get("on", []):
            name, *index = [part] if isinstance(part, str) else part
            target = getattr(target, "get_" + name)(*index)
        verb = next(iter(key for key in step if key not in NO_VERBS))
        return getattr(self, "do_" + verb)(target, step[verb], step)

    def do_get(self, target, member, step):
        return plain(getattr(target, member))

    def do_set(self, target, member, step):
        setattr(target, member, self._values.build(step["value"]))

    def do_call(self, target, member, step):
        result = getattr(target, member)(*(self._values.build(value) for value in step.get("args", [])))
        if step.get("digest"):
            return digest(result)
        return plain(result)

    def do_get_until(self, target, member, step):
        deadline = time.monotonic() + PATIENCE
        value = plain(getattr(target, member))
        while value != step["until"] and time.monotonic() < deadline:
            time.sleep(0.01)
            value = plain(getattr(target, member))
        return value

    def do_type_of(self, target, member, step):
        return target.rrobjecttype if hasattr(target, "rrobjecttype") else RR.RobotRaconteurNode.s.GetObjectType(target)

    # further clients, locks

    def do_open(self, target, name, step):
        url = self._url.replace("service=interop", "service=" + step["service"])
        login = [step["username"], {"password": RR.VarValue(step["password"], "string")}] if "username" in step else []
        self._others[name] = RR.RobotRaconteurNode.s.ConnectService(url, *login)

    def do_leave(self, target, name, step):
        RR.RobotRaconteurNode.s.DisconnectService(self._others.pop(name))

    def do_lock(self, target, kind, step):
        flags = {"user": RR.RobotRaconteurObjectLockFlags_USER_LOCK, "client": RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK}
        RR.RobotRaconteurNode.s.RequestObjectLock(target, flags[kind])

    def do_unlock(self, target, what, step):
        RR.RobotRaconteurNode.s.ReleaseObjectLock(target)

    def do_enter(self, target, what, step):
        RR.RobotRaconteurNode.s.MonitorEnter(target, step["timeout"])

    def do_exit(self, target, what, step):
        RR.RobotRaconteurNode.s.MonitorExit(target)

    # memories

    def do_dimensions(self, target, member, step):
        memory = getattr(target, member)
        return list(memory.Dimensions) if hasattr(memory, "Dimensions") else [memory.Length]

    def do_read_memory(self, target, member, step):
        memory, position, size = getattr(target, member), step["position"], step["size"]
        data = numpy.zeros(size, self._values.item_type(step["of"]), order="F")
        if hasattr(memory, "Dimensions"):
            memory.Read(position, data, [0] * len(size), size)
        else:
            memory.Read(position[0], data, 0, size[0])
        return digest(data.flatten(order="F")) if step.get("digest") else plain(data)

    def do_write_memory(self, target, member, step):
        memory, position, data = getattr(target, member), step["position"], self._values.build(step["value"])
        if hasattr(memory, "Dimensions"):
            memory.Write(position, data, [0] * data.ndim, list(data.shape))
        else:
            memory.Write(position[0], data, 0, len(data))

    # generators

    def do_generate(self, target, member, step):
        arguments = (self._values.build(value) for value in step.get("args", []))
        self._generators[step["as"]] = getattr(target, member)(*arguments)

    def do_next(self, target, name, step):
        given = [self._values.build(step["value"])] if "value" in step else []
        return plain(self._generators[name].Next(*given))

    def do_close_generator(self, target, name, step):
        self._generators[name].Close()

    def do_abort_generator(self, target, name, step):
        self._generators[name].Abort()

    # events

    def do_listen(self, target, member, step):
        seen = self._events.setdefault(member, [])

        def happened(*arguments):
            with self._news:
                seen.append([plain(argument) for argument in arguments])
                self._news.notify_all()

        hook = getattr(target, member)
        hook += happened

    def do_events(self, target, member, step):
        seen = self._events[member]
        with self._news:
            self._news.wait_for(lambda: len(seen) >= step["count"], PATIENCE)
            return {"list": seen}

    # wires

    def do_connect(self, target, member, step):
        connection = getattr(target, member).Connect()

        def changed(wire, value, time):
            with self._news:
                self._news.notify_all()

        connection.WireValueChanged += changed
        self._wires[member] = connection

    def do_in_value(self, target, member, step):
        connection = self._wires[member]

        def value():
            return plain(connection.InValue) if connection.InValueValid else None

        with self._news:
            self._news.wait_for(lambda: value() == step["until"], PATIENCE)
            return value()

    def do_out_value(self, target, member, step):
        self._wires[member].OutValue = self._values.build(step["value"])

    def do_close(self, target, member, step):
        self._wires.pop(member).Close()

    def do_peek_in(self, target, member, step):
        return plain(getattr(target, member).PeekInValue()[0])

    def do_peek_out(self, target, member, step):
        return plain(getattr(target, member).PeekOutValue()[0])

    def do_poke_out(self, target, member, step):
        getattr(target, member).PokeOutValue(self._values.build(step["value"]))

    # callbacks

    def do_answer(self, target, member, step):
        seen = self._callbacks.setdefault(member, [])

        def called(*arguments):
            with self._news:
                seen.append([plain(argument) for argument in arguments])
                self._news.notify_all()
            if "fail" in step:
                raise RR.OperationFailedException(step["fail"])
            return self._values.build(step["value"])

        getattr(target, member).Function = called

    def do_asked(self, target, member, step):
        seen = self._callbacks[member]
        with self._news:
            self._news.wait_for(lambda: len(seen) >= step["count"], PATIENCE)
            return {"list": list(seen)}

    # pipes

    def do_open_pipe(self, target, member, step):
        endpoint = getattr(target, member).Connect(step.get("index", -1))
        pipe = self._pipes[step["as"]] = Pipe(endpoint)

        def arrived(endpoint):
            with self._news:
                self._news.notify_all()

        def closed(endpoint):
            with self._news:
                pipe.is_closed = True
                self._news.notify_all()

        endpoint.PacketReceivedEvent += arrived
        endpoint.PipeEndpointClosedCallback = closed
        return endpoint.Index

    def do_send(self, target, name, step):
        endpoint = self._pipes[name].endpoint
        for value in step["values"]:
            if endpoint.IsUnreliable:  # the blocking call never returns there
                endpoint.AsyncSendPacket(self._values.build(value), lambda number, error: None)
            else:
                endpoint.SendPacket(self._values.build(value))

    def do_packets(self, target, name, step):
        pipe = self._pipes[name]
        with self._news:
            self._news.wait_for(lambda: len(pipe.take()) >= step["count"], PATIENCE)
            return {"list": list(pipe.take())}

    def do_close_pipe(self, target, name, step):
        self._pipes.pop(name).endpoint.Close()

    def do_closed(self, target, name, step):
        with self._news:
            return self._news.wait_for(lambda: self._pipes[name].is_closed, PATIENCE)


class Pipe:
    def __init__(self, endpoint):
        self.endpoint = endpoint
        self.is_closed = False
        self._packets = []

    def take(self):
        """Everything that has come until now."""
        while self.endpoint.Available:
            self._packets.append(plain(self.endpoint.ReceivePacket()))
        return self._packets


def digest(items):
    return {"count": len(items), "first": plain(items[0]), "last": plain(items[-1]), "sum": float(items.sum(dtype="float64"))}


def error_of(exception):
    if isinstance(exception, RR.RobotRaconteurException):
        return {"name": exception.errorname, "message": exception.message}
    return {"name": type(exception).__name__, "message": str(exception)}


def main(url):
    steps = json.load(sys.stdin)["steps"]
    results = []
    with RR.ClientNodeSetup(argv=quiet_node.arguments(server=False)):
        try:
            client = Client(url)
        except Exception as exception:
            print(json.dumps({"connect_error": error_of(exception)}), flush=True)
            return
        for step in steps:
            try:
                results.append({"value": client.carry_out(step)})
            except Exception as exception:
                results.append({"error": error_of(exception)})
        print(json.dumps({"results": results}), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
