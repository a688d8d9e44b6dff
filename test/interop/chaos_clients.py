"""Clients for chaos.py: each works for as long as it is wanted, comes back whenever it has lost its connection, and says what it
found that must not be."""
import contextlib
import http.client
import json
import random
import socket
import sys
import threading
import time

import websockets.exceptions

from http_api import Stream, ask
from json_sockets import Socket
from processes import ROOT, Background

LOSSES = (OSError, http.client.HTTPException, EOFError, ValueError, websockets.exceptions.WebSocketException)  # ValueError: half a document
PEERS = ROOT / "test" / "interop" / "peers"


class Findings:
    """What all clients have found, counted and judged."""

    def __init__(self):
        self._lock = threading.Lock()
        self.broken = []
        self.counts = {}
        self.answered = set()  # tokens of calls
        self.last_values = {}  # of the wire, by client

    def break_(self, who, what):
        with self._lock:
            self.broken.append(f"{who}: {what}")
        print(f"BROKEN {who}: {what}", flush=True)

    def count(self, what, number=1):
        with self._lock:
            self.counts[what] = self.counts.get(what, 0) + number

    def answer(self, who, token, answer):
        if token != answer:
            return self.break_(who, f"call {token} was given the answer {answer}")
        with self._lock:
            self.answered.add(token)
        self.count("calls")


class Tokens:
    """One for each call of all."""

    def __init__(self):
        self._lock, self._last = threading.Lock(), 0

    def next(self, count=1):
        with self._lock:
            self._last += count
            return self._last - count + 1


class Client:
    """A thread; `work()` returns, or throws one of LOSSES, when its connection is gone."""

    def __init__(self, name, site):
        self.name, self.site, self.findings = name, site, site.findings
        self.is_wanted = True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while self.is_wanted:
            try:
                self.work()
            except LOSSES:
                self.findings.count("connections lost")
            except AssertionError:  # refused
                self.findings.count("refusals")
            except Exception as error:  # noqa: BLE001: a thread that ends unseen would look like a clean run
                self.findings.break_(self.name, f"{type(error).__name__}: {error}")
                return
            time.sleep(0.1)

    def stop(self):
        self.is_wanted = False
        self._thread.join(30)
        if self._thread.is_alive():
            self.findings.break_(self.name, "does not come to an end")


class Caller(Client):
    """Calls by HTTP, each on a connection of its own."""

    def work(self):
        token = self.site.tokens.next()
        answer = ask(self.site.port, "POST", f"{self.site.base}/once", {"token": token})
        if answer.status == 200:
            self.findings.answer(self.name, token, answer.json["result"])
        elif answer.status not in (401, 404, 409, 423, 500, 502, 503, 504):
            self.findings.break_(self.name, f"call {token} was answered with {answer.status}: {answer.body[:200]}")


class Insider(Client):
    """Asks a device that no fault is for, on one connection and past all lines: whatever else breaks, it is answered, and soon,
    as long as the gateway itself is there."""

    bound = 2.0  # seconds; all the others, and their devices, use the machine as well

    def __init__(self, name, site):
        self.times = []
        super().__init__(name, site)

    def work(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.site.port, timeout=20)
        begin = time.monotonic()
        try:
            while self.is_wanted:
                begin = time.monotonic()
                connection.request("POST", "/api/v1/devices/ours/interop/add", '{"left": 1, "right": 2}',
                                   {"Content-Type": "application/json"})
                answer = connection.getresponse()
                text = answer.read()
                self.judge(begin, answer.status, text)
                time.sleep(0.01)
        except LOSSES as error:
            if self.is_wanted and not self.site.was_away_since(begin):
                self.findings.break_(self.name, f"lost its connection: {error!r}")
            raise
        finally:
            connection.close()

    def judge(self, begin, status, text):
        took = time.monotonic() - begin
        if self.site.was_away_since(begin):
            return
        if status != 200 and self.site.is_recovering:
            return  # the gateway has come back, and looks for its devices
        if status != 200:
            return self.findings.break_(self.name, f"was answered with {status}: {text[:200]}")
        if took > self.bound:
            self.findings.break_(self.name, f"waited {took:.2f} s for an answer")
        self.site.is_recovering = False
        self.times.append(took)
        self.findings.count("answers inside")

    def p99(self):
        """Seconds."""
        return sorted(self.times)[len(self.times) * 99 // 100] if self.times else 0.0


class Publisher(Client):
    """Gives the wire new values."""

    def work(self):
        self.site.publish(self.site.tokens.next())


class Follower(Client):
    """Reads a stream of events."""

    socket = None

    def work(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.site.front.port, timeout=20)
        connection.connect()
        self.socket = connection.sock  # the connection itself soon forgets it
        try:
            stream = Stream(self.site.front.port, f"{self.site.base}/{self.member}", connection=connection)
            self.follow(stream)
        finally:
            self.socket.close()
            connection.close()

    def stop(self):
        self.is_wanted = False
        with contextlib.suppress(OSError, AttributeError):
            self.socket.shutdown(socket.SHUT_RDWR)
        super().stop()


class Listener(Follower):
    """Hears events, which follow one another as long as nothing is said of a lost connection."""

    member = "ticked"

    def follow(self, stream):
        last = None
        while self.is_wanted:
            _, kind, event = stream.next()
            if kind == "state":
                last = None
                continue
            number = event["number"]
            if last is not None and number != last + 1:
                self.findings.break_(self.name, f"event {number:.0f} came behind {last:.0f}")
            last = number
            self.findings.count("events")


class Watcher(Follower):
    """Follows the wire."""

    member = "value"

    def follow(self, stream):
        while self.is_wanted:
            _, kind, event = stream.next()
            if kind != "state":
                self.findings.last_values[self.name] = event
                self.findings.count("values")


class Piper(Client):
    """Sends packets over a JSON socket. What comes back is what was sent, in its order; nothing is left out as long as nothing is
    said of a lost connection."""

    factor = 1
    member = "echo"

    @property
    def base(self):
        return self.site.base

    def work(self):
        with Socket(self.site.front.port, self.base, close_timeout=1) as page:
            subscription = page.open("subscribe", self.member)
            stream, sent, received, is_whole = random.randrange(1, 1 << 20), 0, 0, True
            while self.is_wanted or (is_whole and received < sent):
                if self.is_wanted and sent - received < 50:
                    sent += 1
                    page.send("send", self.member, value=stream * 1_000_000 + sent)
                message = json.loads(page.socket.recv(timeout=30))
                if "error" in message:
                    is_whole = False
                elif message.get("state") == "connection_lost":
                    is_whole = False
                elif message.get("state") == "connected":
                    stream, sent, received, is_whole = stream + 1, 0, 0, True
                elif message.get("state") == "closed":
                    return
                elif message.get("subscription") == subscription and "value" in message:
                    of, number = divmod(int(message["value"] / self.factor), 1_000_000)
                    if of != stream:
                        continue  # of a stream before: it has been broken
                    if number <= received or (is_whole and number != received + 1):
                        self.findings.break_(self.name, f"packet {number} came behind {received}")
                    received = number
                    self.findings.count("packets")


class OurPiper(Piper):
    """The same with the device of ours."""

    factor = 2
    member = "doubled"
    base = "/api/v1/devices/ours/interop"


class Locker(Client):
    """Writes while it holds a lock, and reads what it has written. Who has no lock writes nothing."""

    def work(self):
        with Socket(self.site.port, self.site.base, close_timeout=1) as page:
            while self.is_wanted:
                mine = self.site.tokens.next()
                if "error" in page.next(id=page.send("lock", "vault", kind="client")):
                    time.sleep(0.02)
                    continue
                answers = [page.next(id=page.send(op, path, **more)) for op, path, more in (
                    ("set", "vault/owner", {"value": mine}), ("get", "vault/owner", {}), ("unlock", "vault", {}))]
                if any("error" in answer for answer in answers):
                    continue  # the lock went with the session with the device
                if answers[1]["result"] != mine:
                    self.findings.break_(self.name, f"held the lock and wrote {mine}; {answers[1]['result']} was there")
                self.findings.count("locks")


class Program:
    """A client of the reference, as a process that can be killed and stopped."""

    def __init__(self, name, site, url):
        self.name, self.site, self._url = name, site, url
        self._lock = threading.Lock()
        self.start()

    def start(self):
        first = self.site.tokens.next(1_000_000)
        self.process = Background([sys.executable, PEERS / "chaos_client.py", self._url, first], self.site.folder / f"{self.name}.log")
        threading.Thread(target=self._read, args=(self.process.process,), daemon=True).start()

    def _read(self, process):
        findings = self.site.findings
        for line in iter(process.stdout.readline, b""):
            if not line.endswith(b"\n"):
                return  # killed in the middle of it
            for what, value in json.loads(line).items():
                if what == "answered":
                    findings.answer(self.name, value, value)
                elif what == "echoed":
                    findings.count("packets of the reference", value)
                elif what == "value":
                    findings.last_values[self.name] = value
                else:
                    findings.break_(self.name, value)
        if (code := process.wait()) > 0:  # not by a signal
            findings.break_(self.name, f"has ended with {code}; {self.name}.log says why")

    def kill(self):
        self.process.process.kill()
        self.process.process.wait()

    def stop(self):
        self.kill()
