"""A shell as a reader has it: in a folder with what the pages name, with the programs on its path, and with a network of its
own, so that commands run as they stand, on the ports that they name."""
import json
import os
import pathlib
import re
import signal
import shutil
import subprocess
import sys
import sysconfig
import threading
import time

from processes import BUILD, ROOT

DEADLINE = 30.0  # seconds for one command
FIRST_ANSWERS = 3.0  # seconds that the devices of a gateway have to answer it; a reader types no faster

# What goes on until it is ended, and the port by which others reach it.
SERVERS = {r"rrgate demo --port 8081\b": 8081, r"(build/release/server/)?rrgate (demo|serve|proxy)\b": 8080, r"\S+/python examples/thermostat/device\.py": 52230,
           r"build-examples/thermostat_device": 52230, r"\S+/python -m reynard_the_robot": 29200}


class Shell:
    def __init__(self, folder):
        self.folder = folder
        programs = folder / "bin"
        programs.mkdir()
        (programs / "rrgate").symlink_to(BUILD / "server" / "rrgate")
        python = pathlib.Path(sys.executable)
        node = python.parent / "node"  # where ./dev setup found none on the machine
        if node.exists():
            (programs / "node").symlink_to(node)
        for name in ("build", "docker", "robdef", "wasm-client"):
            (folder / name).symlink_to(ROOT / name)
        shutil.copytree(ROOT / "examples", folder / "examples", ignore=shutil.ignore_patterns("node_modules", "rrgate-client"))
        (folder / "build-examples").mkdir()
        (folder / "build-examples/thermostat_device").symlink_to(BUILD / "test/examples/thermostat_device")
        environment = {**os.environ, "PATH": f"{programs}:/usr/bin:{os.environ['PATH']}:/usr/sbin:/sbin", "LC_ALL": "C.UTF-8",
                       # What pip finds here it does not download: there is no network.
                       "PYTHONPATH": sysconfig.get_path("purelib"),
                       "ROBOTRACONTEUR_SYSTEM_PREFIX": str(folder), "ROBOTRACONTEUR_USER_HOME": str(folder / "home"),
                       "ROBOTRACONTEUR_SYSTEM_CONFIG_DIR": str(folder / "home"), "HOME": str(folder / "home")}
        self._servers = {}
        self._bash = subprocess.Popen(["unshare", "--net", "bash", "--noprofile", "--norc"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True, cwd=folder, env=environment, start_new_session=True)
        assert self.run("ip link set lo up") == ("", 0)

    def run(self, command):
        """What a command prints, and its exit code. A server is started, and waited for."""
        port = next((port for words, port in SERVERS.items() if re.match(words, command)), None)
        return self._start(command.removesuffix("&").strip(), port) if port else self._ask(command)

    def _start(self, command, port):
        if port in self._servers:
            self._ask(f"kill {self._servers[port]}; wait {self._servers[port]}")
        log = self.folder / f"log-{port}"
        said, code = self._ask(f"{command} >{log} 2>&1 & echo $!")
        self._servers[port] = int(said)
        is_up = f"(exec 3<>/dev/tcp/127.0.0.1/{port}) 2>/dev/null"
        _, late = self._ask(f"for i in $(seq 200); do {is_up} && break; sleep 0.05; done; {is_up}")
        assert late == 0, f"{command}: nobody listens on port {port}\n{log.read_text()}"
        self._await_devices(port)
        return "", code

    def _await_devices(self, port):
        deadline = time.monotonic() + FIRST_ANSWERS
        while time.monotonic() < deadline:
            said, _ = self._ask(f"curl -s --max-time 1 http://127.0.0.1:{port}/readyz")
            try:
                ready = json.loads(said)
            except ValueError:
                return  # no gateway, or one that speaks TLS
            if "devices" not in ready or ready["devices"] == ready["devices_online"]:
                return  # a node that listens by HTTP has no such counts
            time.sleep(0.05)

    def _ask(self, command):
        self._bash.stdin.write(f"{command}\nprintf '\\n<<%d>>\\n' $?\n")
        self._bash.stdin.flush()
        watch = threading.Timer(DEADLINE, self.end)
        watch.start()
        lines = []
        for line in self._bash.stdout:
            if code := re.fullmatch(r"<<(\d+)>>\n", line):
                watch.cancel()
                return "".join(lines).removesuffix("\n"), int(code[1])
            lines.append(line)
        raise AssertionError(f"{command}: not done within {DEADLINE} s; it said\n{''.join(lines)}")

    def end(self):
        try:
            os.killpg(self._bash.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self._bash.wait()


def commands_of(text):
    """The commands of a block, each with what it shall print: None in a block that shows no output."""
    joined = re.sub(r"\\\n", "\\\\\0", text)
    found = []
    is_transcript = text.startswith("$ ")
    for line in joined.splitlines():
        line = line.replace("\0", "\n")
        if is_transcript and line.startswith("$ "):
            found.append([line[2:], []])
        elif is_transcript:
            found[-1][1].append(line)
        elif line.strip() and not line.startswith("#"):
            found.append([line, None])
    return [(command, None if lines is None else "\n".join(lines)) for command, lines in found]


def looks_like(expected, said):
    """Whether the output is the one of the page, in which "..." stands for anything."""
    pattern = re.sub(r"(?:\\\.){3}", ".*", re.escape(expected.strip()))
    return re.fullmatch(pattern, said.strip(), re.DOTALL) is not None


def trace(path: pathlib.Path):
    return "".join(f"\n{log.name}: {log.read_text()[-2000:]}" for log in path.glob("log-*"))
