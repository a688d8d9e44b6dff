#!/usr/bin/env python3
"""The USB transport end to end, through a real kernel: no hardware, no modules of this machine's kernel.

run.py [--build DIR] [--kernel DIR] [--junit FILE] [pattern]

A QEMU guest (Debian's kernel, by software alone) sees this machine's files read-only and runs the programs of the build.
Its USB controller has a device that rr-usb-emulator plays: guest_test.cpp talks to it through libusb, then rr-test-client
calls a service through the device, and through rrgate and the device; and the reference, with its own USB transport, does
so too, which says whether the device is one:

  guest:  rr-test-client [--rr+tcp--> rrgate] --rr+usb--> libusb, kernel, xHCI
          Python package RobotRaconteur --rr+usb--> libusb ...
  host:   QEMU --usbredir--> rr-usb-emulator --rr+tcp--> rr-test-service

--kernel is a folder with boot/vmlinuz-* and lib/modules/* of Debian's linux-image package.
"""
import argparse
import itertools
import json
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import xml.etree.ElementTree as ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test/interop"))
from guest import make_initrd, qemu_command  # noqa: E402
GUEST_LIMIT = 240.0  # seconds; 40 are usual, more where other programs want the processors too
MODULES = ["virtio_pci", "9pnet_virtio", "9p", "usbcore", "xhci_pci", "cuse"]
PYTHON = ROOT / "build/deps/venv/bin/python"
GATEWAY_PORT = 52990  # of the guest, which has no other network than its loopback

INIT = r"""mount -t 9p -o trans=virtio,version=9p2000.L,ro,msize=262144,cache=loose host /host
for folder in dev sys proc; do mount --bind /$folder /host/$folder; done
mount -t tmpfs t /host/run; cp -r /given /host/run/given
ip link set lo up
echo "MARK ready $(cut -d' ' -f1 /proc/uptime)"
exec chroot /host /bin/sh /run/given/guest.sh
"""

GUEST = r"""cd {root}
is_plugged_in() {{
  for vendor in /sys/bus/usb/devices/*/idVendor; do
    [ "$(cat $vendor)" = 1209 ] && ls -d ${{vendor%/idVendor}}/*:1.* && return
  done > /dev/null 2>&1
  return 1
}}
tries=0
until is_plugged_in || [ $tries -ge 150 ]; do /bin/busybox usleep 200000; tries=$((tries + 1)); done
echo "MARK junit begin"
{build}/test/usb/rr-usb-guest-test -w NoTests -r junit {pattern}
status=$?
echo "MARK junit end $status"
echo "MARK direct begin"
{build}/test/interop/cpp/rr-test-client 'rr+usb:///?nodename=interop.service&service=interop' < /run/given/scenario.json
echo "MARK direct end"
{build}/server/rrgate serve --config /run/given/gateway.json > /run/gateway.log 2>&1 &
gateway=$!
tries=0
until grep -q 'device online' /run/gateway.log || [ $tries -ge 50 ]; do /bin/busybox usleep 200000; tries=$((tries + 1)); done
echo "MARK client begin"
{build}/test/interop/cpp/rr-test-client '{url}' < /run/given/scenario.json
echo "MARK client end"
echo "MARK log begin"
cat /run/gateway.log
echo "MARK log end"
kill $gateway; wait $gateway
if [ -x {python} ]; then
echo "MARK other junit begin"
{build}/test/usb/rr-usb-guest-test -w NoTests -r junit '[interface-0]'
status=$?
echo "MARK other junit end $status"
echo "MARK reference begin"
timeout 60 {python} -B /run/given/reference.py 2>&1
echo "MARK reference end"
fi
/bin/busybox poweroff -f
"""

REFERENCE = """
import json
import RobotRaconteur as RR
with RR.ClientNodeSetup(argv=["--robotraconteur-hardware-enable=true"]):
    root = RR.RobotRaconteurNode.s.ConnectService("rr+usb:///?nodename=interop.service&service=interop")
    print(json.dumps([root.add(1.5, 2.25), list(root.ramp(3000))[-1], root.version]))
"""
REFERENCE_ANSWER = [3.75, 2999.0, "1"]

# As in test/interop/scenarios.py: small things, then an array of 2 MB.
SCENARIO = [
    ({"call": "add", "args": [{"double": 1.5}, {"double": 2.25}]}, 3.75),
    ({"call": "join", "args": [{"list": ["a", "b", "c"]}, ", "]}, "a, b, c"),
    ({"call": "ramp", "args": [{"uint32": 4}]}, [0.0, 1.0, 2.0, 3.0]),
    ({"call": "sum", "args": [{"ramp": 262144}]}, 34359607296.0),
    ({"get": "version"}, "1"),
]


def between(text, name):
    found = re.search(rf"^MARK {name} begin\n(.*?)^MARK {name} end( \d+)?$", text, re.DOTALL | re.MULTILINE)
    return found[1] if found else ""


class Run:
    def __init__(self, arguments):
        self.build = arguments.build.resolve()
        self.kernel = arguments.kernel.resolve()
        self.pattern = arguments.pattern
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="rr-usb-"))
        self.processes = []

    def start(self, *command, **options):
        process = subprocess.Popen([str(word) for word in command], stdin=subprocess.PIPE, start_new_session=True, **options)
        self.processes.append(process)
        return process

    def stop(self):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.wait()

    def guest_output(self):
        service = self.start(self.build / "test/interop/cpp/rr-test-service", stdout=subprocess.PIPE)
        port = json.loads(service.stdout.readline())["port"]
        bus = self.folder / "usb"
        emulator = self.start(self.build / "test/usb/rr-usb-emulator", bus, port, "interop.service",
                              stdout=subprocess.PIPE)
        emulator.stdout.readline()
        given = self.folder / "given"
        given.mkdir()
        url = f"rr+tcp://127.0.0.1:{GATEWAY_PORT}/?nodename=interop.service&service=interop"
        (given / "gateway.json").write_text(json.dumps({
            "listen": [f"127.0.0.1:{GATEWAY_PORT}"],
            "devices": [{"name": "usb", "url": "rr+usb:///?nodename=interop.service"}]}))
        (given / "scenario.json").write_text(json.dumps({"steps": [step for step, _ in SCENARIO]}))
        (given / "guest.sh").write_text(GUEST.format(root=ROOT, build=self.build, url=url, python=PYTHON,
                                                         pattern=shlex.quote(self.pattern) if self.pattern else ""))
        (given / "reference.py").write_text(REFERENCE)
        initrd = self.folder / "initrd.gz"
        make_initrd(initrd, INIT, MODULES, self.kernel, given)
        qemu = self.start(*qemu_command(
            initrd, "/", "-device", "qemu-xhci", "-chardev", f"socket,id=bus,path={bus}", "-device", "usb-redir,chardev=bus",
            folder=self.kernel), stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        timer = threading.Timer(GUEST_LIMIT, qemu.kill)
        timer.start()
        text = qemu.stdout.read().decode("utf-8", "replace").replace("\r", "")
        timer.cancel()
        return text


def add_case(suite, name, failure=None):
    case = ElementTree.SubElement(suite, "testcase", classname="usb", name=name)
    if failure is not None:
        ElementTree.SubElement(case, "failure", message=name).text = failure


def add_guest_cases(suite, text, name):
    """One more says whether there were any, and that the program found them all good: a test that asserts nothing is not
    in its report."""
    problem = "ran no test"
    try:
        junit = between(text, name)
        for case in ElementTree.fromstring(junit[junit.index("<?xml"):]).iter("testcase"):
            suite.append(case)
            problem = None
    except (ValueError, ElementTree.ParseError) as error:
        problem = f"{error}\n{text[-4000:]}"
    if not problem and f"MARK {name} end 0\n" not in text:
        problem = f"the program failed\n{between(text, name)[-4000:]}"
    add_case(suite, f"the guest's {name}", problem)


def add_scenario_cases(suite, text, name, way):
    try:
        answer = json.loads(between(text, name))
        results = answer.get("results", [answer] * len(SCENARIO))
    except ValueError as problem:
        results = [f"{problem}: {between(text, name)}"] * len(SCENARIO)
    for (step, expected), result in itertools.zip_longest(SCENARIO, results, fillvalue=("no step", "no result")):
        is_right = isinstance(result, dict) and result.get("value") == expected
        add_case(suite, f"{way}: {json.dumps(step)}",
                 None if is_right else f"found {result}, expected {expected}\n{between(text, 'log')[-2000:]}")


def judge(text):
    """The guest's own test cases, one for each step of the scenarios, and one for the reference."""
    suite = ElementTree.Element("testsuite", name="usb")
    add_guest_cases(suite, text, "junit")
    add_scenario_cases(suite, text, "direct", "client on USB")
    add_scenario_cases(suite, text, "client", "through rrgate and USB")
    if PYTHON.exists():
        add_guest_cases(suite, text, "other junit")
        said = between(text, "reference").strip()
        # Behind its answer it may say that it has crashed: its USB transport does at times, when it ends.
        is_right = json.dumps(REFERENCE_ANSWER) in said.splitlines()
        add_case(suite, "the reference uses the device", None if is_right else said or text[-2000:])
    return suite


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--kernel", type=pathlib.Path, default=ROOT / "build/deps/linux")
    parser.add_argument("--junit", type=pathlib.Path)
    parser.add_argument("pattern", nargs="?", help="which of the guest's test cases to run, as Catch2 takes it")
    arguments = parser.parse_args()
    started = time.monotonic()
    run = Run(arguments)
    try:
        text = run.guest_output()
    finally:
        run.stop()
        shutil.rmtree(run.folder)
    print(text)
    suite = judge(text)
    if arguments.junit:
        ElementTree.ElementTree(suite).write(arguments.junit, encoding="utf-8", xml_declaration=True)
    failed = [case for case in suite if case.find("failure") is not None or case.find("error") is not None]
    for case in failed:
        print("FAILED:", case.get("name"))
    print(f"{len(suite) - len(failed)} passed, {len(failed)} failed, {time.monotonic() - started:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
