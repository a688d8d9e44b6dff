"""Fixtures of the interoperability tests: one pair of service and route at a time, shared by its scenarios."""
import json
import os
import shutil
import socket
import sys
import tempfile

import pytest

from clients import Chromium
from directions import DIRECTIONS, LEVELS, LOCAL_URL, PEERS, service_command
from gateways import RRGATE
from matrix import Matrix
from processes import ROOT, Background, free_port, start_gateway
from tls_nodes import make_lab

matrix = Matrix()


def pytest_configure(config):
    """Local nodes keep their files in a folder of this run: no other node of the machine is met, none is disturbed."""
    config.local_folder = tempfile.mkdtemp(prefix="rr-interop-")  # short: it is part of a socket's path
    os.environ.update(local_variables(config.local_folder))


def local_variables(folder):
    return {"ROBOTRACONTEUR_SYSTEM_PREFIX": folder, "ROBOTRACONTEUR_USER_RUN_DIR": folder + "/run",
            "ROBOTRACONTEUR_USER_HOME": folder + "/home"}


def pytest_unconfigure(config):
    shutil.rmtree(config.local_folder, ignore_errors=True)


@pytest.fixture
def own_local_folder(monkeypatch):
    """Local nodes of the test do not meet those of a link, which last until the next one."""
    with tempfile.TemporaryDirectory(prefix="rr-interop-") as folder:
        for name, value in local_variables(folder).items():
            monkeypatch.setenv(name, value)
        yield


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    """What it says of the table of scenarios."""
    report = (yield).get_result()
    params = item.callspec.params if hasattr(item, "callspec") else {}
    if "scenario" in params and (report.when == "call" or report.failed):
        direction, level = params["link"]
        report.user_properties.append(("matrix", [params["scenario"].name, direction.name, level]))


def pytest_runtest_logreport(report):
    for name, value in report.user_properties:
        if name == "matrix":
            matrix.note(*value, report.passed)


def pytest_sessionfinish(session):
    if not hasattr(session.config, "workerinput"):  # of the process that hears from all others
        matrix.write(ROOT / "build" / "test-logs" / "interop-matrix.md")


@pytest.fixture(scope="session")
def node():
    """The real package in this process: it starts once, and not again."""
    import RobotRaconteur as RR
    import quiet_node
    setup = RR.ClientNodeSetup(argv=["test", *(f"--robotraconteur-{name}={value}" for name, value in quiet_node.QUIET.items())])
    yield RR.RobotRaconteurNode.s
    setup.close()


def pytest_generate_tests(metafunc):
    if "link" in metafunc.fixturenames:
        pairs = [(direction, direction.level) for direction in DIRECTIONS]
        if metafunc.definition.get_closest_marker("direct"):
            # The tap reads bare streams; what a WebSocket carries is masked.
            pairs = [(direction, level) for direction in DIRECTIONS for level in LEVELS if direction.route == "direct"]
        if metafunc.definition.get_closest_marker("pages"):
            pairs = [pair for pair in pairs if pair[0].client == "chromium"]
        metafunc.parametrize("link", pairs, indirect=True, scope="module",
                             ids=[f"{direction.name}-{level}" for direction, level in pairs])


@pytest.hookimpl(tryfirst=True)  # before the groups are read
def pytest_collection_modifyitems(config, items):
    """Scenarios that a client or a service cannot carry out are not its tests."""
    def is_known(item):
        params = item.callspec.params if hasattr(item, "callspec") else {}
        scenario, link = params.get("scenario"), params.get("link")
        return not scenario or not link or link[0].knows(scenario)

    config.hook.pytest_deselected(items=[item for item in items if not is_known(item)])
    items[:] = filter(is_known, items)
    for item in items:
        item.add_marker(pytest.mark.xdist_group(group_of(item)))


def group_of(item):
    """Tests of a group run one after the other: those of a link, those with the network's namespaces, else a file's."""
    if "network" in item.fixturenames:
        return "network"
    if hasattr(item, "callspec") and "link" in item.callspec.params:
        direction, level = item.callspec.params["link"]
        return f"{direction.name}-{level}"
    return item.path.stem


@pytest.fixture
def carries(record_property):
    """carries(client, service, scheme[, device_scheme]): says in the JUnit file what the test shows, for transports.py:
    client ("ours" in any language, "reference") and service understand each other by the scheme; with a device_scheme,
    through the gateway, which reaches the service by that."""
    def note(client, service, *schemes):
        assert len(schemes) in (1, 2)
        record_property("carries", " ".join(["reference" if client == "reference" else "ours", service, *schemes]))
    return note


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    browser = Chromium(tmp_path_factory.mktemp("chromium"))
    yield browser
    browser.stop()


@pytest.fixture(scope="module")
def link(request, chromium, tmp_path_factory):
    """A running service, behind the gateway where the direction says so: (direction, level, port)."""
    direction, level = request.param
    folder = tmp_path_factory.mktemp("link")
    service = Background(service_command(direction, level, chromium.origin), folder / "service.log")
    gateway = None
    try:
        ready = json.loads(service.next_line())
        port = ready["port"]
        if direction.route.startswith("gateway"):
            device_url = LOCAL_URL if direction.route == "gateway-ws-local" else ready["url"]
            mode = {"mode": "shared"} if direction.is_shared else {}
            gateway, port = start_gateway(folder, device_url, chromium.origin, device=mode)
        yield direction, level, port
        if gateway:
            code, description = gateway.stop(), gateway.description()
            gateway = None
            assert code == 0, f"the gateway did not end by itself: {description}"
    finally:
        if gateway:
            gateway.stop()
        service.stop()


@pytest.fixture(scope="module")
def device(tmp_path_factory):
    """The URL of a service of the reference."""
    service = Background([sys.executable, PEERS / "service.py"], tmp_path_factory.mktemp("device") / "service.log")
    yield json.loads(service.next_line())["url"]
    service.stop()


@pytest.fixture(scope="module", params=["reference", "ours"])
def gateway(request, tmp_path_factory):
    """The port of a gateway to a device of either make."""
    folder = tmp_path_factory.mktemp("gateway")
    direction = next(each for each in DIRECTIONS if each.name == f"reference-to-{request.param}")
    service = Background(service_command(direction, "v4", "http://localhost"), folder / "service.log")
    url = json.loads(service.next_line())["url"]
    process, port = start_gateway(folder, url)
    yield port
    assert process.stop() == 0, process.description()
    service.stop()


@pytest.fixture(scope="session")
def lab(tmp_path_factory):
    """A folder with certificates, as tls_nodes.make_lab has it."""
    return make_lab(tmp_path_factory.mktemp("lab"))


@pytest.fixture(scope="module")
def reynard(tmp_path_factory):
    log = tmp_path_factory.mktemp("reynard") / "log"
    port = free_port()
    device = Background([sys.executable, "-m", "reynard_the_robot", "--quiet", "--disable-ascii-socket",
                         "--http-port", free_port(), f"--robotraconteur-tcp-port={port}"], log)

    def is_listening():
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    device.wait_until(is_listening)
    url = f"rr+tcp://127.0.0.1:{port}/?service=reynard"
    # The reference makes an object for the first client that asks; for two at the same moment it makes it twice, and fails. So
    # there is a first one, and it stays.
    values = log.with_name("values")
    values.touch()
    first = Background(["sh", "-c", f"exec {RRGATE} watch '{url}' state --csv >{values}"], log.with_name("first"))
    first.wait_until(lambda: values.stat().st_size)
    yield url
    first.stop()
    device.stop()


@pytest.fixture(scope="module")
def standard_robot(tmp_path_factory):
    port = free_port()
    robot = Background([sys.executable, PEERS / "standard_robot.py", port],
                       tmp_path_factory.mktemp("robot") / "log")
    robot.next_line()
    yield f"rr+tcp://127.0.0.1:{port}/?service=robot"
    robot.stop()


@pytest.fixture
def own_service(tmp_path):
    """A service that no other test uses, so that it can be paused: (process, URL)"""
    process = Background([sys.executable, PEERS / "service.py"], tmp_path / "service.log")
    yield process, json.loads(process.next_line())["url"]
    process.stop()
