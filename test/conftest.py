"""What holds for all tests in Python."""
import pytest

# Checks that helpers make count as the test's own.
pytest.register_assert_rewrite("clients", "cpp_frames", "found_nodes", "gateways", "http_api", "load", "network", "news", "pages",
                               "processes", "reverse_proxies", "serial_scenarios", "shell", "tap", "users")


def pytest_runtest_call(item):
    item.has_asserted = "raises" in item.function.__code__.co_names  # that what it expects has come, pytest itself looks


def pytest_assertion_pass(item):
    item.has_asserted = True


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    """A test that asserted nothing has failed."""
    report = (yield).get_result()
    if report.when == "call" and report.passed and not item.has_asserted:
        report.outcome, report.longrepr = "failed", f"{item.nodeid} asserted nothing"
