"""Processes of the harness: started on free ports, waited for by what they say, always ended."""
import functools
import http.client
import json
import os
import pathlib
import random
import selectors
import signal
import socket
import subprocess
import time
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("RR_BUILD", ROOT / "build" / "release"))
START_DEADLINE = 30.0  # seconds until a process must be ready


def free_port():
    """Below those that the system gives to connections: until somebody listens on it, no connection takes it."""
    while True:
        port = random.randrange(10000, 32768)
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
                return port
            except OSError:
                pass


class Background:
    """A process that runs beside the tests. Its standard input stays open while it is wanted."""

    def __init__(self, command, log, environment={}):
        self.command = [str(word) for word in command]
        self._log = pathlib.Path(log)
        with open(self._log, "wb") as errors:
            # A session of its own: whatever it starts is ended with it.
            self.process = subprocess.Popen(self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                            stderr=errors, start_new_session=True, cwd=ROOT,
                                            env={**os.environ, **environment})
        self._output = b""  # read, but not asked for yet

    def next_line(self, within=START_DEADLINE):
        """The next line that the process prints."""
        deadline = time.monotonic() + within
        with selectors.DefaultSelector() as selector:
            selector.register(self.process.stdout, selectors.EVENT_READ)
            while b"\n" not in self._output:
                if not selector.select(max(0.0, deadline - time.monotonic())):
                    raise AssertionError(f"no line after {within} s: {self.description()}")
                chunk = os.read(self.process.stdout.fileno(), 65536)
                if not chunk:
                    raise AssertionError(f"ended before it printed a line: {self.description()}")
                self._output += chunk
        line, self._output = self._output.split(b"\n", 1)
        return line.decode()

    def write_line(self, value):
        self.process.stdin.write(json.dumps(value).encode() + b"\n")
        self.process.stdin.flush()

    def wait_until(self, is_ready):
        deadline = time.monotonic() + START_DEADLINE
        while not is_ready():
            if self.process.poll() is not None:
                raise AssertionError(f"ended before it was ready: {self.description()}")
            if time.monotonic() > deadline:
                raise AssertionError(f"not ready after {START_DEADLINE} s: {self.description()}")
            time.sleep(0.02)

    def description(self):
        return f"{' '.join(self.command)}\n(exit {self.process.poll()}) {self._log.read_text(errors='replace')[-4000:]}"

    def pause(self):
        """It stands still until it is resumed or ended. Returns when each of its threads does: a signal takes its time."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED | os.WEXITED | os.WNOWAIT)

    def resume(self):
        self.process.send_signal(signal.SIGCONT)

    def stop(self):
        """Asks, then kills. Returns the exit code, or None where it had to be killed."""
        code = None
        try:
            self.resume()
            self.process.stdin.close()
            self.process.send_signal(signal.SIGTERM)
            code = self.process.wait(10)
        except (subprocess.TimeoutExpired, BrokenPipeError):
            pass
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()
        self.process.stdout.close()
        return code


def read_json(url, asked_from=""):
    """What an HTTP server says to one who comes from that address; None where it cannot be reached."""
    parts = urllib.parse.urlsplit(url)
    connection = http.client.HTTPConnection(parts.netloc, timeout=5, source_address=(asked_from, 0))
    try:
        connection.request("GET", parts.path)
        answer = connection.getresponse()
        return json.load(answer) if answer.status == 200 else None
    except OSError:
        return None
    finally:
        connection.close()


def start_gateway(folder, device_url, page_origin=None, device={}, asked_from="", host=None, on=None, port=None, is_up=None, **more):
    """A gateway to one device, called "interop", when it has reached it: (process, port). `device` and `more` are
    further members of the device's configuration and of the whole; it is asked how it is from `asked_from`. `on` makes
    the command that runs it elsewhere, `host` is a network.Network and a host of it to run it on. `port`: that one.
    `is_up` says when the device is reached, where that is not for everybody to see."""
    port = port or free_port()
    config = folder / "gateway.json"
    config.write_text(json.dumps({
        "listen": [f"127.0.0.1:{port}"],
        "allowed_origins": [page_origin] if page_origin else [],
        "devices": [{"name": "interop", "url": device_url, **device}],
        **more,
    }))
    network, number = host or (None, None)
    on = on or (functools.partial(network.on, number) if network else lambda *command: command)
    get_json = functools.partial(network.get_json, number) if network else functools.partial(read_json, asked_from=asked_from)
    gateway = Background(on(BUILD / "server" / "rrgate", "serve", "--config", config), folder / "gateway.log")

    def device_is_up():
        answer = get_json(f"http://127.0.0.1:{port}/api/v1/devices")
        return answer is not None and answer["devices"][0]["state"] == "online"

    try:
        gateway.wait_until(is_up or device_is_up)
    except BaseException:
        gateway.stop()
        raise
    return gateway, port
