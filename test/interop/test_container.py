"""The container image: built by podman from programs that were compiled already, and made of the Debian package by `./dev package
image`; both are run as they are meant to be run."""
import base64
import ipaddress
import json
import os
import re
import shutil
import ssl
import subprocess
import sys
import time

import jsonschema_rs
import pytest
import yaml

from access_gateways import cookie_of
from gateways import RRGATE, rrgate, running
from http_api import ask, fetch
from machine import need
from processes import BUILD, ROOT, START_DEADLINE, free_port
from reverse_proxies import UNPACKED, is_open
from users import bearer

DOCKER = ROOT / "docker"
DEPS = ROOT / "build" / "deps"
BASE = DEPS / "container-base.tar"  # ./dev test made it; where it can't, images can't be built
PACKAGES = ROOT / "build" / "package"
LARGEST = 90 * 1024 * 1024

STORAGE = """[storage]
driver = "{driver}"
runroot = "{folder}/run"
graphroot = "{folder}/graph"
"""
CONTAINERS = """[containers]
netns = "host"
[engine]
cgroup_manager = "cgroupfs"
events_logger = "file"
runtime = "crun"
[engine.runtimes]
crun = ["{folder}/bin/crun"]
"""
# Machines whose root may not raise limits: the runtime would fail at those that podman asks for.
CRUN = """#!/usr/bin/python3
import json, os, sys
for before, word in zip(sys.argv, sys.argv[1:]):
    path = os.path.join(word, "config.json") if before in ("--bundle", "-b") else word
    if before in ("--bundle", "-b", "--process", "-p"):
        config = json.load(open(path))
        config.get("process", config).pop("rlimits", None)
        json.dump(config, open(path, "w"))
os.execv("/usr/bin/crun", ["crun", *sys.argv[1:]])
"""


class Podman:
    def __init__(self, folder):
        self.folder = folder
        (folder / "bin").mkdir()
        crun = folder / "bin" / "crun"
        crun.write_text(CRUN)
        crun.chmod(0o755)
        (folder / "storage.conf").write_text(STORAGE.format(driver="overlay", folder=folder))
        (folder / "containers.conf").write_text(CONTAINERS.format(folder=folder))
        self.environment = {**os.environ, "CONTAINERS_STORAGE_CONF": str(folder / "storage.conf"),
                            "CONTAINERS_CONF": str(folder / "containers.conf")}

    def __call__(self, *arguments, within=120, fails=False):
        # A mount namespace of its own, without the second hierarchy of control groups that the runtime doesn't know.
        words = ["unshare", "-m", "--propagation", "private", "sh", "-c",
                 'umount /sys/fs/cgroup/unified 2>/dev/null; exec podman "$@"', "podman", *map(str, arguments)]
        result = subprocess.run(words, capture_output=True, text=True, timeout=within, env=self.environment)
        assert fails or result.returncode == 0, f"podman {' '.join(words[8:])}\n{result.stdout}{result.stderr}"
        return result.stdout


@pytest.fixture(scope="module")
def podman(tmp_path_factory):
    need("containers")
    folder = tmp_path_factory.mktemp("podman")
    yield Podman(folder)
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="module", params=["built", "packaged"])
def image(request, podman, tmp_path_factory):
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def packaged(podman, tmp_path_factory):
    """Of the package that ./dev test made, in the archive that is given to `docker load`."""
    need("image-debs")
    (deb,) = PACKAGES.glob("rrgate_*_amd64.deb")
    archive = tmp_path_factory.mktemp("archive") / "image.tar"
    subprocess.run([sys.executable, "-B", ROOT / "cmake/make_image.py", "--package", deb, "--debian", DEPS / "image-debs-amd64",
                    "--dockerfile", DOCKER / "Dockerfile", "--config", DOCKER / "gateway.json", "--output", archive],
                   check=True, timeout=120, env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000"})
    said = podman("load", "-i", archive)
    return re.search(r"Loaded image: (\S+/rrgate:\S+)", said)[1]


@pytest.fixture(scope="module")
def built(podman, tmp_path_factory):
    podman("import", BASE, "docker.io/library/debian:bookworm-slim")
    context = tmp_path_factory.mktemp("context")
    shutil.copytree(DOCKER, context / "docker", ignore=shutil.ignore_patterns("prebuilt"))
    prebuilt = context / "docker" / "prebuilt"
    for program, folder in [("server/rrgate", "bin"), ("examples/demo/rrgate-demo-create", "libexec/rrgate"),
                            ("examples/demo/rrgate-demo-webcams", "libexec/rrgate")]:
        (prebuilt / folder).mkdir(parents=True, exist_ok=True)
        target = prebuilt / folder / program.split("/")[-1]
        subprocess.run(["strip", "-o", target, BUILD / program], check=True)
    shutil.copytree(ROOT / "web" / "dist", prebuilt / "share" / "rrgate" / "web")
    (prebuilt / "share/doc/rrgate").mkdir(parents=True)
    shutil.copy(ROOT / "build/third-party.txt", prebuilt / "share/doc/rrgate")
    # The format of Docker: the other one has no health check.
    podman("build", "--format=docker", "--pull=never", "--isolation=chroot", "--network=host", "-t", "rrgate",
           "-f", context / "docker" / "Dockerfile", context, within=300)
    return "localhost/rrgate"


def test_the_image_is_small_and_nobody_is_root(podman, image):
    (about,) = json.loads(podman("image", "inspect", image))
    assert about["Size"] <= LARGEST, about["Size"]
    assert about["User"] == about["Config"]["User"] == "10001:10001"
    assert about["Healthcheck"]["Test"][:3] == ["CMD", "/usr/bin/rrgate", "health"]
    print(f"{about['Size'] / 1e6:.1f} MB")


def test_the_image_trusts_the_cas_of_debian(podman, image, tmp_path):
    (about,) = json.loads(podman("image", "inspect", image))
    (file,) = [each.split("=")[1] for each in about["Config"]["Env"] if each.startswith("SSL_CERT_FILE=")]
    podman("create", "--name=cas", "--network=host", "--cgroups=disabled", image)
    try:
        podman("cp", f"cas:{file}", tmp_path / "cas.pem")
    finally:
        podman("rm", "-f", "cas", fails=True)
    assert len(ssl.create_default_context(cafile=tmp_path / "cas.pem").get_ca_certs()) > 100


def test_the_image_has_the_notices_of_what_is_in_it(podman, image, tmp_path):
    podman("create", "--name=notices", "--network=host", "--cgroups=disabled", image)
    try:
        for file, name in (("doc/rrgate/third-party.txt", "libcli11-dev"), ("rrgate/web/licenses.txt", "emscripten")):
            podman("cp", f"notices:/usr/share/{file}", tmp_path / name)
            assert re.search(rf"^{name}\n=+\n", (tmp_path / name).read_text(), re.M), file
    finally:
        podman("rm", "-f", "notices", fails=True)


def test_a_container(podman, image, tmp_path):
    """Read-only, without rights, with the demo device in a container of its own."""
    port, device = free_port(), free_port()
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({"listen": [f"127.0.0.1:{port}"], "devices": [
        {"name": "create", "url": f"rr+tcp://127.0.0.1:{device}/?service=Create"}]}))
    config.chmod(0o644)
    tmp_path.chmod(0o755)
    bare = ["--network=host", "--cgroups=disabled", "--read-only", "--read-only-tmpfs=false", "--cap-drop=ALL",
            "--security-opt=no-new-privileges"]
    podman("run", "-d", "--name=create", *bare, "--no-healthcheck", "--entrypoint=/usr/libexec/rrgate/rrgate-demo-create",
           image, "--host", "127.0.0.1", "--port", device)
    (about,) = json.loads(podman("image", "inspect", image))
    check = about["Healthcheck"]["Test"][1:]
    assert check[-1] == "127.0.0.1:8080"
    check[-1] = f"127.0.0.1:{port}"  # the machine's network is shared here
    podman("run", "-d", "--name=gateway", *bare, f"--volume={config}:/etc/rrgate/gateway.json:ro",
           "--health-interval=disable", "--health-cmd", json.dumps(check), image)
    try:
        deadline = time.monotonic() + START_DEADLINE
        entries = []
        while not (entries and entries[0]["state"] == "online"):
            assert time.monotonic() < deadline, podman("logs", "gateway", fails=True)
            try:
                entries = json.loads(fetch(port, "/api/v1/devices")[2])["devices"]
            except OSError:
                time.sleep(0.05)
        assert b'<div id="app">' in fetch(port, "/")[2]
        podman("healthcheck", "run", "gateway")
        (about,) = json.loads(podman("inspect", "gateway"))
        status = open(f"/proc/{about['State']['Pid']}/status").read()
        assert re.search(r"^Uid:\s10001\s10001\s", status, re.M)
        assert re.search(r"^CapEff:\s0+$", status, re.M)
        mounts = open(f"/proc/{about['State']['Pid']}/mounts").read()
        assert re.search(r"^\S+ / \S+ ro", mounts, re.M)
        assert about["State"]["Health"]["Status"] == "healthy"
        podman("stop", "gateway", within=30)
        (about,) = json.loads(podman("inspect", "gateway"))
        assert about["State"]["ExitCode"] == 0
    finally:
        podman("rm", "-f", "gateway", "create", fails=True)


def test_what_a_gateway_keeps_is_in_volumes(podman, image, tmp_path):
    """Read-only otherwise, as docs/deploy.md has it: who has signed out, and the audit log, in a container after another."""
    port = free_port()
    tmp_path.chmod(0o750)
    os.chown(tmp_path, 0, 10001)
    token = rrgate("token", tmp_path / "tokens", "ci", "--roles", "admin")
    for name, text in {"ticket.key": "of this test alone " * 3, "gateway.json": json.dumps({
            "listen": [f"127.0.0.1:{port}"], "devices": [], "audit": {"file": "/var/log/rrgate/audit.jsonl"},
            "access": {"tokens_file": "tokens", "ticket_key_file": "ticket.key"}})}.items():
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o640)
        os.chown(tmp_path / name, 0, 10001)
    page = {"Origin": f"http://127.0.0.1:{port}"}

    def start():
        podman("run", "-d", "--name=keeper", "--network=host", "--cgroups=disabled", "--no-healthcheck", "--read-only",
               "--read-only-tmpfs=false", "--cap-drop=ALL", f"--volume={tmp_path}:/etc/rrgate:ro",
               "--volume=state:/var/lib/rrgate", "--volume=log:/var/log/rrgate", image)
        deadline = time.monotonic() + START_DEADLINE
        while not is_open(port):
            assert time.monotonic() < deadline, podman("ps", "-a")
            time.sleep(0.05)

    def who(cookie):
        return ask(port, "GET", "/api/v1/access", headers={"Cookie": cookie}).json["user"]

    try:
        start()
        cookies = [cookie_of(ask(port, "POST", "/api/v1/session", headers={**page, **bearer(token)})) for _ in range(2)]
        assert ask(port, "DELETE", "/api/v1/session", headers={**page, "Cookie": cookies[0]}).status == 204
        podman("rm", "-f", "-t", "20", "keeper")
        start()
        assert [who(cookie) for cookie in cookies] == [None, "ci"]
        podman("cp", "keeper:/var/log/rrgate/audit.jsonl", tmp_path / "audit.jsonl")
        events = [json.loads(line)["event"] for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
        assert events == ["started", "signed_in", "signed_in", "signed_out", "stopped", "started"]
    finally:
        podman("rm", "-f", "keeper", fails=True)
        podman("volume", "rm", "-f", "state", "log", fails=True)


def test_the_demo_in_a_container_asks_for_its_password(podman, image):
    port = free_port()
    podman("run", "-d", "--name=demo", "--network=host", "--cgroups=disabled", "--no-healthcheck", image, "demo", "--port", port)
    try:
        deadline = time.monotonic() + START_DEADLINE
        while "rrgate demo: http://" not in (said := podman("logs", "demo", fails=True)):
            assert time.monotonic() < deadline, said
            time.sleep(0.1)
        password = re.search(r"user demo, password (\S+)", said)[1]
        login = base64.b64encode(f"demo:{password}".encode()).decode()
        assert fetch(port, "/api/v1/devices")[0] == 401
        assert fetch(port, "/api/v1/devices", headers={"Authorization": f"Basic {login}"})[0] == 200
    finally:
        podman("rm", "-f", "demo", fails=True)


def test_configurations_of_the_compose_files():
    for name in ("gateway.json", "demo.json"):
        result = subprocess.run([str(RRGATE), "check-config", DOCKER / name], capture_output=True, text=True, timeout=20)
        assert result.returncode == 0, result.stderr
    for compose in DOCKER.glob("compose.*.yaml"):
        for file in re.findall(r'"?(\./[^:\s"]+):/', compose.read_text()):
            assert (DOCKER / file).is_file(), f"{compose.name}: {file}"
    # The proxy that is trusted is the one that has the address.
    trusted = re.search(r'"trusted_proxies": \["([^"]+)"\]', (DOCKER / "demo.json").read_text())[1]
    assert f"ipv4_address: {trusted} " in (DOCKER / "compose.caddy.yaml").read_text()


def merged(first, second):
    """As Compose does it with two files: maps by their keys, lists one behind the other, else the second."""
    if isinstance(first, dict) and isinstance(second, dict):
        return {key: merged(first[key], second[key]) if key in first and key in second else {**first, **second}[key]
                for key in {**first, **second}}
    return first + second if isinstance(first, list) and isinstance(second, list) else second


@pytest.mark.parametrize("names", [("demo",), ("demo", "caddy"), ("demo", "monitoring"), ("demo", "caddy", "monitoring")],
                         ids="+".join)
def test_the_compose_files_are_such(names):
    """By the schema of Debian's docker-compose, alone and one upon the other; and they say nothing that they don't have."""
    schema = UNPACKED / "usr/lib/python3/dist-packages/compose/config/compose_spec.json"
    assert schema.is_file(), f"{schema} is missing: ./dev test interop brings it"
    validator = jsonschema_rs.validator_for(json.loads(schema.read_text()))
    whole = {}
    for name in names:
        whole = merged(whole, yaml.safe_load((DOCKER / f"compose.{name}.yaml").read_text()))
        # The schema is older than the name of a project.
        errors = [f"{error.instance_path}: {error.message}" for error in
                  validator.iter_errors({key: value for key, value in whole.items() if key != "name"})]
        assert not errors, errors
    ports = [port.rsplit(":", 1)[0] for service in whole["services"].values() for port in service.get("ports", [])]
    assert len(ports) == len(set(ports)), "two services have one port"
    assert all(port.startswith("127.0.0.1:") for port in ports), "the demo has no users, so it is for this machine alone"
    (addresses,) = whole["networks"]["default"]["ipam"]["config"]
    subnet = ipaddress.ip_network(addresses["subnet"])
    handed_out = ipaddress.ip_network(addresses.get("ip_range", addresses["subnet"]))  # to whoever asks for none
    assert handed_out.subnet_of(subnet)
    for name, service in whole["services"].items():
        assert "image" in service, name
        for volume in service.get("volumes", []):
            source = volume.split(":")[0]
            assert source.startswith("./") or source in whole["volumes"], f"{name}: {volume}"
        for network in service.get("networks", {}).values():
            fixed = ipaddress.ip_address(network["ipv4_address"])
            assert fixed in subnet and fixed not in handed_out, f"{name}: {fixed}"


def test_the_dashboard_asks_for_what_there_is(tmp_path):
    with running(tmp_path, {"devices": [{"name": "x", "url": "rr+tcp://127.0.0.1:1/?service=x", "mode": "shared"}]}) as gateway:
        names = set(gateway.metrics())
    known = {name.split("{")[0] for name in names}
    dashboard = json.loads((DOCKER / "grafana" / "rrgate.json").read_text())
    assert [(each["name"], each["type"]) for each in dashboard["templating"]["list"]] == [("datasource", "datasource")]
    assert {panel["datasource"]["uid"] for panel in dashboard["panels"]} == {"${datasource}"}  # whichever it is there
    assert "uid" not in (DOCKER / "grafana" / "datasource.yaml").read_text()
    panels = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    alerts = []
    mounts = yaml.safe_load((DOCKER / "compose.monitoring.yaml").read_text())["services"]["prometheus"]["volumes"]
    for file in yaml.safe_load((DOCKER / "prometheus.yaml").read_text())["rule_files"]:
        assert f"./{file}:/etc/prometheus/{file}:ro" in mounts
        for group in yaml.safe_load((DOCKER / file).read_text())["groups"]:
            for rule in group["rules"]:
                assert rule["alert"] and rule["labels"]["severity"] and set(rule["annotations"]) == {"summary", "description"}
                alerts.append(rule["expr"])
    for expressions in panels, alerts:
        asked = {name for each in expressions for name in re.findall(r"\b(?:rrgate|process)_\w+", each)}
        assert len(asked) >= 8 and asked <= known, asked - known
    # Values of labels that are fixed words are those that there are.
    labels = {(name, value) for each in alerts for name, value in re.findall(r'(\w+)="(\w+)"', each)} - {("job", "rrgate")}
    assert labels and all(any(f'{name}="{value}"' in each for each in names) for name, value in labels), labels


def test_prometheus_takes_the_rules_and_the_dashboards_expressions(tmp_path):
    """By Debian's promtool: names and labels are looked at above, here it is the language."""
    promtool = UNPACKED / "usr/bin/promtool"
    assert promtool.is_file(), f"{promtool} is missing: ./dev test interop brings it"
    dashboard = json.loads((DOCKER / "grafana" / "rrgate.json").read_text())
    expressions = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
    rules = [{"record": f"panel_{number}", "expr": each} for number, each in enumerate(expressions)]
    (tmp_path / "panels.yaml").write_text(yaml.safe_dump({"groups": [{"name": "dashboard", "rules": rules}]}))
    for what, file in (("config", DOCKER / "prometheus.yaml"), ("rules", tmp_path / "panels.yaml")):  # the configuration names rules.yaml
        result = subprocess.run([promtool, "check", what, file], capture_output=True, text=True, timeout=20, check=False)
        assert result.returncode == 0, result.stdout + result.stderr
        assert re.search(r"SUCCESS: \d+ rules found", result.stdout), result.stdout


def test_the_unit_is_one(tmp_path):
    """As systemd reads it, with a program that is there."""
    need("systemd")
    for name, source in (("rrgate.service", "rrgate.service.in"), ("rrgate.socket", "rrgate.socket")):
        text = (ROOT / "gateway-config" / source).read_text()
        (tmp_path / name).write_text(text.replace("@RRGATE_BINDIR@/rrgate", "/bin/true"))
    for name in ("rrgate.service", "rrgate.socket"):
        result = subprocess.run(["systemd-analyze", "verify", tmp_path / name], capture_output=True, text=True, timeout=60)
        assert (result.returncode, result.stderr) == (0, "")
    result = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=20", tmp_path / "rrgate.service"],
                            capture_output=True, text=True, timeout=60)
    assert result.returncode == 0, result.stdout[-300:]
    (said,) = re.findall(r"rates its exposure ([\d.]+) ", (ROOT / "docs/deploy.md").read_text())
    assert f"Overall exposure level for rrgate.service: {said} " in result.stdout


def test_the_apparmor_profile_is_one(tmp_path):
    """As the parser reads it, for the service of this name alone; nothing is loaded."""
    need("apparmor")
    profile = ROOT / "cmake" / "deb" / "apparmor"
    command = ["apparmor_parser", "--skip-kernel-load", "--skip-cache"]
    result = subprocess.run([*command, profile], capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 0, result.stderr
    names = subprocess.run([*command, "--names", profile], capture_output=True, text=True, timeout=60, check=True).stdout
    assert names.split() == ["rrgate"]
    (chosen,) = re.findall(r"^AppArmorProfile=-(\w+)$", (ROOT / "gateway-config" / "rrgate.service.in").read_text(), re.M)
    assert chosen == "rrgate"
    wrong = tmp_path / "wrong"
    wrong.write_text(profile.read_text().replace("/usr/bin/rrgate mr,", "/usr/bin/rrgate mz,"))
    assert subprocess.run([*command, wrong], capture_output=True, timeout=60, check=False).returncode != 0
