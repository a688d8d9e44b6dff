"""What holds for all tests in Python."""
import faulthandler
import os
import signal
import sys

import pytest

DEADLINE = 120.0  # seconds, for a test and for what it needs first; beyond it, it has failed
LAST_DEADLINE = DEADLINE + 30.0  # beyond it, where it waits in a library that no signal ends, the run is ended with all stacks printed

# In CI pytest compares lists line by line in full, also where they are the same and an assertion has passed (see below): minutes
# for some thousand values.
for name in ("CI", "BUILD_NUMBER"):
    os.environ.pop(name, None)

# Checks that helpers make count as the test's own.
pytest.register_assert_rewrite("clients", "cpp_frames", "found_nodes", "gateways", "http_api", "load", "network", "news", "pages",
                               "processes", "reverse_proxies", "serial_scenarios", "shell", "tap", "users")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    item.has_asserted = "raises" in item.function.__code__.co_names  # that what it expects has come, pytest itself looks
    return (yield from in_time())


def pytest_assertion_pass(item):
    item.has_asserted = True


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    """A test that asserted nothing has failed."""
    report = (yield).get_result()
    if report.when == "call" and report.passed and not item.has_asserted:
        report.outcome, report.longrepr = "failed", f"{item.nodeid} asserted nothing"


def begin():
    signal.setitimer(signal.ITIMER_REAL, DEADLINE)
    faulthandler.dump_traceback_later(LAST_DEADLINE, exit=True, file=stderr)


def end():
    signal.setitimer(signal.ITIMER_REAL, 0)
    faulthandler.cancel_dump_traceback_later()


def give_up(number, frame):
    pytest.fail(f"not done after {DEADLINE:g} s")


def pytest_configure():
    global stderr
    stderr = os.dup(sys.__stderr__.fileno())  # that of tests is captured, and lost where the run ends
    signal.signal(signal.SIGALRM, give_up)


def in_time():
    begin()
    try:
        return (yield)
    finally:
        end()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup():
    return (yield from in_time())


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown():
    return (yield from in_time())


@pytest.fixture
def deadline():
    """A test that does the same thing many times calls it for each of them."""
    return begin
