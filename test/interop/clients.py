"""Test clients of all kinds: each carries out the steps of a scenario."""
import json
import os
import signal
import subprocess
import sys

from directions import ENABLE_LOCAL, LOCAL_URL, PEERS
from processes import BUILD, ROOT, Background, free_port

STEP_DEADLINE = 60.0  # seconds for a client to carry out one scenario
JS = ROOT / "test" / "interop" / "js"


def run_client(direction, port, scenario, chromium=None):
    """Hands the steps of a scenario to the client of a direction. Returns what it says, as run_program."""
    if direction.client == "chromium":
        return chromium.ask({"url": client_url(direction, port), "steps": without_expectations(scenario.steps)})
    return run_program(client_command(direction, port), scenario.steps)


def client_url(direction, port):
    if direction.speaks_javascript:
        path = "devices/interop" if direction.route.startswith("gateway") else ""
        return f"ws://127.0.0.1:{port}/{path}?service=interop"
    return {
        "direct": f"rr+tcp://127.0.0.1:{port}/?service=interop",
        "direct-ws": f"rr+ws://127.0.0.1:{port}/?service=interop",
        "local": LOCAL_URL,
        # A native client names the device that it wants; the gateway is only the way to it.
        "gateway-tcp": f"rr+tcp://127.0.0.1:{port}/?nodename=interop.service&service=interop",
        # What is shared is a node of the gateway's, with the name that the gateway has for the device.
        "gateway-shared-tcp": f"rr+tcp://127.0.0.1:{port}/?nodename=interop&service=interop",
        "gateway-shared-ws": f"rr+ws://127.0.0.1:{port}/devices/interop?service=interop",
        "gateway-ws": f"rr+ws://127.0.0.1:{port}/devices/interop?service=interop",
        "gateway-ws-local": f"rr+ws://127.0.0.1:{port}/devices/interop?service=interop",
    }[direction.route]


def client_command(direction, port):
    url = client_url(direction, port)
    return {
        "reference": [sys.executable, PEERS / "client.py", url, "--robotraconteur-disable-stringtable=false", ENABLE_LOCAL],
        "ours": [BUILD / "test/interop/cpp/rr-test-client", url],
        "node": ["node", JS / "client.mjs", url],
    }[direction.client]


def without_expectations(steps):
    """What the client is told of a scenario."""
    return [{key: value for key, value in step.items() if not key.startswith("expect") and key not in ("message", "any_order")}
            for step in steps]


def run_program(command, steps, environment={}):
    """What a client program prints: {"results": [...]} or {"connect_error": {...}}."""
    client = subprocess.Popen([str(word) for word in command], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, start_new_session=True, cwd=ROOT,
                              env={**os.environ, **environment})
    try:
        output, errors = client.communicate(json.dumps({"steps": without_expectations(steps)}), timeout=STEP_DEADLINE)
    except subprocess.TimeoutExpired:
        os.killpg(client.pid, signal.SIGKILL)
        output, errors = client.communicate()
        raise AssertionError(f"client still busy after {STEP_DEADLINE} s\n{output[-2000:]}\n{errors[-4000:]}") from None
    lines = output.strip().splitlines()
    if client.returncode != 0 or not lines:
        raise AssertionError(f"client ended with {client.returncode}\n{output[-2000:]}\n{errors[-4000:]}")
    return json.loads(lines[-1])


def check_step(what, step, result):
    """`what` names the step where it fails."""
    if "expect_error" in step:
        assert "error" in result, f"{what}\nwanted an error, got {result}"
        assert result["error"]["name"] == step["expect_error"], what
        assert step.get("message", "") in result["error"]["message"], what
        return
    assert "error" not in result, f"{what}\nfailed: {result['error']}"
    wanted, found = step["expect"], result.get("value")
    if step.get("any_order"):  # The reference hands events to a pool of threads.
        wanted, found = ({"list": sorted(value["list"])} for value in (wanted, found))
    assert found == wanted, what


def check_all(steps, answer):
    """What a client program printed is what the steps expect."""
    assert "results" in answer, answer
    for number, (step, result) in enumerate(zip(steps, answer["results"], strict=True), 1):
        check_step(f"step {number}: {json.dumps(step, ensure_ascii=False)[:400]}", step, result)


def run_and_check(kind, url, steps):
    """Client programs of the reference, or of Node, whose URLs begin with ws:."""
    command = {"reference": [sys.executable, PEERS / "client.py", url.replace("ws://", "rr+ws://")],
               "node": ["node", JS / "client.mjs", url]}[kind]
    check_all(steps, run_program(command, steps))


class Chromium:
    """One browser for the whole run, started when it is needed first; a page of its own for each scenario."""

    def __init__(self, folder):
        self._log = folder / "chromium.log"
        self._port = free_port()
        self._driver = None
        self.origin = f"http://127.0.0.1:{self._port}"

    def ask(self, request):
        if not self._driver:
            self._driver = Background(["node", JS / "chromium.mjs", self._port], self._log)
            self._driver.next_line()
        try:
            self._driver.write_line(request)
            return json.loads(self._driver.next_line(STEP_DEADLINE))
        except (AssertionError, OSError):
            self.stop()  # whatever holds it, the next scenario gets a new one
            raise

    def stop(self):
        driver, self._driver = self._driver, None
        if driver:
            driver.stop()
