"""What people meet at a terminal: completion by the shell, texts of devices, a browser that opens."""
import contextlib
import fcntl
import json
import os
import pty
import re
import select
import struct
import subprocess
import sys
import termios
import time

import pytest

from command_line import DEVICE_ERROR, Ran, run, shown_on_terminal
from gateways import RRGATE
from network import Network
from processes import ROOT, START_DEADLINE, Background, free_port
from qr_codes import modules_on_terminal, read_text


def test_text_of_a_device_does_not_command_the_terminal(tmp_path):
    """ESC, and the C1 characters that some terminals obey."""
    device = Background([sys.executable, ROOT / "test" / "interop" / "peers" / "escaping_device.py", (port := free_port())],
                        tmp_path / "log")
    device.next_line()
    url = f"rr+tcp://127.0.0.1:{port}/?service=evil"
    try:
        assert run("get", url, "text") == "a\tb\n\x1b[31mc\x9b31md"  # a file gets what there is
        assert "b\r\n?[31mc?31md" in shown_on_terminal("get", url, "text", standard_output=True)
        assert Ran(["call", url, "fail"]).refused(DEVICE_ERROR, "?[31mwrong")
    finally:
        device.stop()


def test_bash_completes_urls_and_members(reynard):
    script = """source <(rrgate completion bash)
COMP_LINE=$1; COMP_POINT=${#1}
# As bash splits it: ":" and "=" are words by themselves.
read -ra COMP_WORDS <<<"$(sed 's/[:=]/ & /g' <<<"$1")"; COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
_rrgate; echo "${COMPREPLY[@]}" """
    path = f"{os.path.dirname(RRGATE)}:{os.environ['PATH']}"

    def completed(line):
        return subprocess.run(["bash", "-c", script, "bash", line], capture_output=True, text=True, timeout=30,
                              env={**os.environ, "PATH": path}).stdout.split()

    assert completed("rrgate che") == ["check-config", "check"]
    assert completed(f"rrgate get '{reynard}' robot_p") == ["robot_position"]
    assert completed(f"rrgate call '{reynard}' teleport x") == ["x="]


SHELLS = {"bash": (["bash", "--norc", "--noprofile", "-i"], ""),
          "zsh": (["zsh", "-f", "-i"], "autoload -U compinit; compinit -u -D; "),
          "fish": (["fish", "--no-config", "-i", "-C", "function fish_prompt; echo -n 'ready '; end"], "")}


@contextlib.contextmanager
def at_a_shell(shell, folder, completes):
    """Somebody who types into a shell at a terminal, and sees as "got <word>" what a command line of rrgate becomes. `completes`  a line
    of bash: what the program answers to "completion words"."""
    command, first = SHELLS[shell]
    program = folder / "rrgate"
    program.write_text(f"""#!/bin/bash
if [[ "$1 $2" == "completion words" ]]; then {completes}
elif [[ $1 == completion ]]; then {RRGATE} completion {shell}
else printf 'got <%s>\\n' "$@"; echo al''l; fi
""")
    program.chmod(0o755)
    terminal, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 1000, 0, 0))
    environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}", "PS1": "ready ", "TERM": "dumb", "HOME": str(folder)}
    with subprocess.Popen(["setsid", "-c", *command], stdin=theirs, stdout=theirs, stderr=theirs, env=environment, cwd=folder) as process:
        os.close(theirs)
        shown = ""

        def read_until(words):
            nonlocal shown
            deadline = time.monotonic() + 10
            while words not in shown:
                assert time.monotonic() < deadline, shown
                if select.select([terminal], [], [], 0.2)[0]:
                    shown += os.read(terminal, 4096).decode(errors="replace")

        def enter(line):
            """Types it, with Tab for "\t"; returns the words that the program got."""
            nonlocal shown
            shown = ""
            os.write(terminal, f"{line}\n".encode())
            read_until("\nall")
            return re.findall(r"got <(.*)>", shown.replace("\r", "\n"))

        try:
            read_until("ready ")
            load = "rrgate completion fish | source" if shell == "fish" else f"source <(rrgate completion {shell})"
            os.write(terminal, f"{first}{load}; echo lo''aded\n".encode())
            read_until("loaded")
            yield enter
        finally:
            process.kill()
            os.close(terminal)


@pytest.mark.parametrize("typed", ["http://h", "'http://h", '"http://h', "http:", "ht", r"http://h:8080/devices/a\?nodeid=1\&"])
@pytest.mark.parametrize("shell", SHELLS)
def test_urls_that_a_shell_completes_reach_the_program_whole(shell, typed, tmp_path):
    """"&" would run the command beside the shell, without what follows."""
    url = "http://h:8080/devices/a?nodeid=1&service=x"
    with at_a_shell(shell, tmp_path, f"""[[ "{url}" == "${{@: -1}}"* ]] && echo "{url}" """) as enter:
        assert enter(f"rrgate get {typed}\t") == ["get", url]


@pytest.mark.parametrize("shell", SHELLS)
def test_shells_complete_commands_members_and_files(shell, reynard, tmp_path):
    (tmp_path / "lab.robdef").touch()
    with at_a_shell(shell, tmp_path, f'exec {RRGATE} "$@"') as enter:
        assert enter("rrgate check-c\t") == ["check-config"]
        assert enter(f"rrgate get '{reynard}' robot_p\t") == ["get", reynard, "robot_position"]
        assert enter(f"rrgate get --time\t 5 '{reynard}' col\t") == ["get", "--timeout", "5", reynard, "color"]
        assert enter("rrgate check lab\t") == ["check", "lab.robdef"]


@pytest.mark.parametrize("more, desktop, opens", [([], True, True), (["--no-browser"], True, False), (["--lan"], True, False),
                                                  ([], False, False)])
def test_the_demo_opens_a_browser_on_a_desktop(more, desktop, opens, tmp_path):
    browser = tmp_path / "xdg-open"
    browser.write_text(f"#!/bin/sh\necho \"$@\" >{tmp_path}/opening && mv {tmp_path}/opening {tmp_path}/opened\n")
    browser.chmod(0o755)
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environment |= {"PATH": f"{tmp_path}:{os.environ['PATH']}"} | ({"DISPLAY": ":9"} if desktop else {})
    terminal, theirs = pty.openpty()
    with subprocess.Popen([RRGATE, "demo", "webcams", "--port", "0", *more], stdout=theirs, stderr=theirs, env=environment) as demo:
        os.close(theirs)
        try:
            shown = ""
            while not (address := re.search(r"rrgate demo: (http://127\S+)", shown)):
                shown += os.read(terminal, 4096).decode(errors="replace")
            deadline = time.monotonic() + 10
            while opens and not (tmp_path / "opened").exists():
                assert time.monotonic() < deadline
                time.sleep(0.01)
            if opens:
                assert (tmp_path / "opened").read_text().strip() == address[1]
        finally:
            demo.terminate()
            demo.wait()
            os.close(terminal)
    assert (tmp_path / "opened").exists() == opens  # it would have been opened before the demo ended


def shown_by_demo(host, network, *more, on_terminal):
    """What `rrgate demo --lan` prints until its own address, which comes last."""
    terminal, theirs = pty.openpty() if on_terminal else os.pipe()
    command = network.on(host, str(RRGATE), "demo", "webcams", "--port", "0", "--lan", *more)
    with subprocess.Popen(command, stdout=theirs, stderr=subprocess.DEVNULL) as demo:
        os.close(theirs)
        try:
            shown, deadline = b"", time.monotonic() + START_DEADLINE
            while not re.search(rb"rrgate demo: http://127\S+\s", shown):
                assert select.select([terminal], [], [], max(0, deadline - time.monotonic()))[0], shown
                shown += os.read(terminal, 4096)
        finally:
            demo.terminate()
            demo.wait()
            os.close(terminal)
    return shown.decode().splitlines()


def test_a_phone_reads_the_address_of_the_demo():
    network = Network(1)
    try:
        lines = shown_by_demo(0, network, on_terminal=True)
        (url,) = [line.split()[-1] for line in lines if line.startswith("rrgate demo: on the network ")]
        assert re.fullmatch(r"http://10\.77\.0\.1:\d+/", url)
        code = [line for line in lines if "\x1b" in line]  # the devices speak, too
        assert read_text(modules_on_terminal(code, "\x1b[30;107m", "\x1b[0m")) == url
        lines = shown_by_demo(0, network, on_terminal=False)  # a file or a pipe gets words alone
        assert len([line for line in lines if line.startswith("rrgate demo: ")]) == 3, lines
        assert "\x1b" not in "".join(lines)
    finally:
        network.close()


def test_the_script_lists_demos_as_the_program_does():
    listed = subprocess.run([ROOT / "dev", "demo", "--list"], capture_output=True, text=True, timeout=30, check=True)
    assert listed.stdout == subprocess.run([RRGATE, "demo", "--list"], capture_output=True, text=True, timeout=30, check=True).stdout
