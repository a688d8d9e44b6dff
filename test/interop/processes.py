"""Processes of the harness: started on free ports, waited for by what they say, always ended."""
import http.client
import json
import os
import pathlib
import selectors
import signal
import socket
import subprocess
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("RR_BUILD", ROOT / "build" / "release"))
START_DEADLINE = 30.0  # seconds until a process must be ready
STEP_DEADLINE = 60.0  # seconds for a client to carry out one scenario


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


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

    def stop(self):
        """Asks, then kills. Returns the exit code, or None where it had to be killed."""
        code = None
        try:
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


def start_gateway(folder, device_url, page_origin=None, device={}, asked_from="127.0.0.1", **more):
    """A gateway to one device, called "interop", when it has reached it: (process, port). `device` and `more` are
    further members of the device's configuration and of the whole; it is asked how it is from `asked_from`."""
    port = free_port()
    config = folder / "gateway.json"
    config.write_text(json.dumps({
        "listen": [f"127.0.0.1:{port}"],
        "allowed_origins": [page_origin] if page_origin else [],
        "devices": [{"name": "interop", "url": device_url, **device}],
        **more,
    }))
    gateway = Background([BUILD / "server" / "rrgate", "serve", "--config", config], folder / "gateway.log")

    def device_is_up():
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5, source_address=(asked_from, 0))
        try:
            connection.request("GET", "/api/v1/devices")
            (device,) = json.load(connection.getresponse())["devices"]
            return device["state"] == "online"
        except OSError:
            return False
        finally:
            connection.close()

    try:
        gateway.wait_until(device_is_up)
    except BaseException:
        gateway.stop()
        raise
    return gateway, port
