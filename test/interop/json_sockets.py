"""A client of the gateway's JSON WebSockets, as a page would be one."""
import json

from websockets.sync.client import connect

from http_api import BASE, JSON_PROTOCOL


class Socket:
    def __init__(self, port, path=BASE, **options):
        self._connecting = connect(f"ws://127.0.0.1:{port}{path}", subprotocols=[JSON_PROTOCOL], max_size=None, **options)
        self._others = []  # read, but not asked for yet
        self._last_id = 0

    def __enter__(self):
        self.socket = self._connecting.__enter__()
        return self

    def __exit__(self, *reason):
        self._connecting.__exit__(*reason)

    def send(self, op, path="", **more):
        self._last_id += 1
        self.socket.send(json.dumps({"id": self._last_id, "op": op, "path": path, **more}))
        return self._last_id

    def next(self, **wanted):
        """The next message with these members."""
        def fits(message):
            return all(key in message and message[key] == value for key, value in wanted.items())

        for message in self._others:
            if fits(message):
                self._others.remove(message)
                return message
        while True:
            message = json.loads(self.socket.recv(timeout=20))
            if fits(message):
                return message
            self._others.append(message)

    def ask(self, op, path="", **more):
        answer = self.next(id=self.send(op, path, **more))
        assert "error" not in answer, answer
        return answer["result"]

    def refusal(self, op, path="", **more):
        error = self.next(id=self.send(op, path, **more))["error"]
        return error["name"].removeprefix("RobotRaconteur."), error["message"]

    def open(self, op, path, **more):
        """The id of what has been opened."""
        number = self.send(op, path, **more)
        answer = self.next(id=number)
        assert "error" not in answer, answer
        return number
