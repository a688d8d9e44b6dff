"""The gateway as a program: its commands, its configuration and what it says of itself."""
import contextlib
import json
import re
import signal
import subprocess

from http_api import fetch, open_websocket
from processes import BUILD, Background, free_port

RRGATE = BUILD / "server" / "rrgate"


def rrgate(*arguments, given=""):
    """What a command of the program prints; `given` is what it reads."""
    done = subprocess.run([RRGATE, *map(str, arguments)], input=given, capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def make_web_certificates(folder):
    """Of localhost, by a CA of their own; what the gateway's configuration has of them."""
    rrgate("cert", "ca", folder)
    rrgate("cert", "web", folder, "localhost", "127.0.0.1")
    return {"certificates": [{"cert": str(folder / "localhost.pem"), "key": str(folder / "localhost.key")}]}


class Gateway:
    """A gateway with its configuration file at hand."""

    def __init__(self, folder, config, environment={}, command=()):
        self.log = folder / "gateway.log"
        self.file = folder / "gateway.json"
        self.port = free_port()
        self.config = {"listen": [f"127.0.0.1:{self.port}"], "log": {"format": "json"}, **config}
        self.write(self.config)
        self._command, self._environment = command, environment
        self.start()

    def start(self):
        self.process = Background([*self._command, RRGATE, "serve", "--config", self.file], self.log, self._environment)
        try:
            self.wait_until_ready()
        except BaseException:
            self.process.stop()
            raise

    def wait_until_ready(self):
        self.wait_for("listening")

    def write(self, config):
        new = self.file.with_suffix(".new")
        new.write_text(config if isinstance(config, str) else json.dumps(config))
        new.rename(self.file)

    def events(self, name=None):
        """What the log says, or those of its events that have this name."""
        events = [json.loads(line) for line in self.log.read_text().splitlines() if line.endswith("}")]
        return [event for event in events if name in (None, event["event"])]

    def wait_for(self, event, count=1, **fields):
        """The count-th event of this name with these fields."""
        found = []

        def is_there():
            found[:] = [one for one in self.events(event) if fields.items() <= one.items()]
            return len(found) >= count

        self.process.wait_until(is_there)
        return found[count - 1]

    def hang_up(self):
        self.process.process.send_signal(signal.SIGHUP)

    def session(self, name="interop"):
        """An open session that nobody uses."""
        self.wait_for("device online", device=name)
        count = len(self.events("client connected"))
        link = open_websocket(self.port, f"/devices/{name}", f"Origin: http://127.0.0.1:{self.port}\r\n")
        self.wait_for("client connected", count + 1)
        return link

    def metrics(self, port=None):
        status, headers, body = fetch(port or self.port, "/metrics")
        assert (status, headers["Content-Type"]) == (200, "text/plain; version=0.0.4; charset=utf-8")
        return read_metrics(body.decode())


def read_metrics(text):
    """{"name{labels}": value}; every sample belongs to the family before it, every family is named once."""
    values, families, current = {}, set(), None
    for line in text.splitlines():
        if line.startswith("# HELP "):
            current = line.split()[2]
            assert current not in families
            families.add(current)
        elif line.startswith("# TYPE "):
            kind = line.split()[3]
            assert line.split()[2] == current and kind in ("counter", "gauge", "histogram")
            assert (kind == "counter") == current.endswith("_total")
        else:
            found = re.fullmatch(r'(\w+)(?:\{(?:\w+="[^"]*",?)+\})? (\d+(?:\.\d+)?)', line)
            names = [current + end for end in ("_bucket", "_sum", "_count")] if kind == "histogram" else [current]
            assert found and found[1] in names, line
            name, value = line.rsplit(" ", 1)
            assert name not in values
            values[name] = float(value) if "." in value else int(value)
    return values


@contextlib.contextmanager
def running(folder, config, *more):
    gateway = Gateway(folder, config, *more)
    try:
        yield gateway
    finally:
        gateway.process.stop()
