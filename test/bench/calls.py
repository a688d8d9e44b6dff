"""The call benchmark: a service, an echo and a client, each a process of its own, bound to processors."""
import contextlib
import json
import os
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "interop"))

import relay  # noqa: E402
from processes import Background  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
ONE, TWO = "one core", "two cores"
SLOW = "call beside a handler of 5 s"
CORES = sorted(os.sched_getaffinity(0))[:2]
REFERENCE = HERE.parent / "interop" / "peers" / "service.py"


def placement():
    """Where the processes run, in words."""
    words = f"{ONE}: client, service and echo on processor {CORES[0]}"
    if len(CORES) < 2:
        return f"{words}; {TWO}: not measured, there is one"
    siblings = pathlib.Path(f"/sys/devices/system/cpu/cpu{CORES[0]}/topology/thread_siblings_list")
    same = siblings.exists() and str(CORES[1]) in siblings.read_text().strip().replace("-", ",").split(",")
    return (f"{words}; {TWO}: the client on {CORES[0]}, service and echo on {CORES[1]}"
            + (" (threads of one core)" if same else ""))


def commands(build):
    """Commands that print results; what they need runs until the next one is asked for."""
    bench = build / "test" / "bench"
    for name, core in ((ONE, CORES[0]), (TWO, CORES[-1])):
        if name == TWO and len(CORES) < 2:
            return
        with running(core, bench / "bench_peer", "service") as service, running(core, bench / "bench_peer", "echo") as echo:
            for scheme in ("rr+tcp", "rr+ws"):
                yield on(CORES[0], bench / "bench_call", f"{scheme}, {name}", url(scheme, service), echo)
        with running(core, sys.executable, REFERENCE) as reference, running(core, bench / "bench_peer", "echo") as echo, \
                running(core, build / "test" / "interop" / "cpp" / "rr-test-service") as service:
            yield on(CORES[0], bench / "bench_call", f"our client, service of 1.2.8, {name}", url("rr+tcp", reference), echo)
            for whose, port in (("our service", service), ("service of 1.2.8", reference)):
                yield on(CORES[0], sys.executable, HERE / "reference_call.py", f"client of 1.2.8, {whose}, {name}",
                         url("rr+tcp", port), echo)


def slow_handlers(build):
    """As commands(), for what a client waits while the handler of another takes its time."""
    bench = build / "test" / "bench"
    with running(CORES[-1], bench / "bench_peer", "service") as service:
        yield on(CORES[0], bench / "bench_slow", f"{SLOW}, native", url("rr+tcp", service))
        for mode in ("relay", "shared"):
            with relay.gateway(build, service, mode=mode) as gateway:
                at = f"rr+ws://127.0.0.1:{gateway}/devices/device?service=interop"
                yield on(CORES[0], bench / "bench_slow", f"{SLOW}, gateway ({mode})", at)
                yield [sys.executable, HERE / "slow_web.py", f"{SLOW}, gateway ({mode})", gateway]


def on(core, *command):
    return ["taskset", "-c", core, *command]


def url(scheme, port):
    return f"{scheme}://127.0.0.1:{port}/?service=interop"


@contextlib.contextmanager
def running(core, *command):
    """The port of a process that prints it."""
    with tempfile.TemporaryDirectory() as scratch:
        process = Background(on(core, *command), pathlib.Path(scratch) / "log")
        try:
            yield json.loads(process.next_line())["port"]
        finally:
            process.stop()
