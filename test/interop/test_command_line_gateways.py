"""The commands of rrgate and gateways: what they reach, who their users are, and the one that a command is itself."""
import json
import subprocess

import numpy
import pytest

from clients import JS
from command_line import DONE, NOT_UNDERSTOOD, REFUSED, UNREACHABLE, Ran, complete, run
from gateways import RRGATE, Gateway, running
from processes import BUILD, Background, free_port
from shared_sites import start_service
from users import PASSWORDS, make_users

RULES = [{"roles": ["viewer", "operator"], "may": ["read", "subscribe"]},
         {"roles": ["operator"], "members": ["say", "color"], "may": ["write", "call"]}]


@pytest.fixture(scope="module")
def token(tmp_path_factory):
    """Its file and itself."""
    file = tmp_path_factory.mktemp("tokens") / "tokens"
    return file, run("token", file, "ci", "--roles", "operator")


@pytest.fixture(scope="module")
def guarded(reynard, token, tmp_path_factory):
    folder = tmp_path_factory.mktemp("guarded")
    make_users(folder)
    gateway = Gateway(folder, {"devices": [{"name": "fox", "url": reynard, "mode": "shared"}],
                               "access": {"users_file": "users", "tokens_file": str(token[0]), "rules": RULES}})
    gateway.wait_for("device online")
    yield f"http://127.0.0.1:{gateway.port}/devices/fox?service=reynard"
    gateway.process.stop()


def test_a_gateway_is_watched(guarded, tmp_path):
    admin = {"environment": {"RRGATE_PASSWORD": PASSWORDS["alice"]}}
    shown = json.loads(run("top", guarded.split("/devices/")[0], "--count", "1", "--json", "--user", "alice", **admin))
    assert [(each["device"], each["state"]) for each in shown["devices"]] == [("fox", "online")]
    text = run("top", guarded.split("/devices/")[0], "--count", "1", "--user", "alice", **admin)
    assert text.startswith("rrgate ") and "fox" in text and "messages/s" in text and "dropped/s" in text
    assert Ran(["top", "rr+tcp://127.0.0.1:1/"]).refused(NOT_UNDERSTOOD, "http")


def test_a_gateway_is_watched_round_by_round(node, tmp_path):
    """One client does not read what the device publishes."""
    service, url = start_service(tmp_path)
    slow = watching = None
    with running(tmp_path, {"devices": [{"name": "interop", "url": url, "mode": "shared"}]}) as gateway:
        try:
            gateway.wait_for("session open", service="interop")
            slow = Background(["node", JS / "losses.mjs", f"ws://127.0.0.1:{gateway.port}/devices/interop?service=interop"], tmp_path / "slow")
            slow.next_line()
            slow.pause()
            watching = Background([RRGATE, "top", f"http://127.0.0.1:{gateway.port}", "--json"], tmp_path / "top")
            device = node.ConnectService(url)

            def missed():
                for _ in range(20):
                    device.publish_state(numpy.zeros(100_000))
                (line,) = json.loads(watching.next_line())["devices"]
                assert (line["device"], line["clients"]) == ("interop", 1)
                return line["dropped_per_second"] > 0 and line["messages_per_second"] > 0
            slow.wait_until(missed)
            slow.resume()
            node.DisconnectService(device)
        finally:
            for each in slow, watching, service:
                if each:
                    each.stop()


def test_what_a_gateway_reaches_comes_and_goes(tmp_path):
    """The device, and the gateway itself."""
    port = free_port()

    def start_robot():
        return Background([BUILD / "examples" / "demo" / "rrgate-demo-create", "--port", port], tmp_path / "log")

    robot = start_robot()
    gateway = Gateway(tmp_path, {"devices": [{"name": "create", "url": f"rr+tcp://127.0.0.1:{port}/?service=Create"}],
                                 "retry": {"min_ms": 50, "max_ms": 200}})
    base = f"http://127.0.0.1:{gateway.port}"
    watching = subprocess.Popen([RRGATE, "ls", "--watch", "--wait", "1", "--json", base], stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, text=True)
    told = (each for each in map(json.loads, watching.stdout) if each["service"] == "Create")
    try:
        assert next(told)["change"] == "found"
        robot.stop()
        assert next(told)["change"] == "lost"
        robot = start_robot()
        assert next(told)["change"] == "found"
        gateway.process.stop()
        assert next(told)["change"] == "lost"
        gateway.start()
        assert next(told)["change"] == "found"
        watching.kill()
        said = watching.communicate()[1]
        assert said.count("\n") == 1 and base in said and said.endswith("waiting for it\n")
    finally:
        watching.kill()
        watching.communicate()
        gateway.process.stop()
        robot.stop()
    assert Ran(["ls", "--watch", base]).refused(UNREACHABLE, base)


def test_shells_ask_a_gateway_for_its_devices(guarded, tmp_path):
    base = guarded.split("/devices/")[0]
    file = tmp_path / "rrgate" / "logins.json"
    file.parent.mkdir()
    logins = {base: {"user": "alice", "password": PASSWORDS["alice"]}, "https://lab.example/robots/": {"token": "x"}}
    file.write_text(json.dumps({"gateways": logins}))
    file.chmod(0o600)

    def complete_there(*words):
        return complete(*words, environment={"XDG_CONFIG_HOME": str(tmp_path)})

    for typed in "/", "/dev", "/devices/", "/devices/fo", "/devices/fox?service=rey":
        assert complete_there("get", base + typed) == [guarded], typed
    assert complete_there("get", base + "/devices/cr") == []
    assert complete_there("get", guarded, "col") == ["color"]
    assert complete_there("top", "") == [base + "/", "https://lab.example/robots/"]
    assert complete_there("get", "http") == complete_there("top", "http") == [base + "/", "https://lab.example/robots/"]
    assert base + "/" in complete_there("ls", "")
    assert complete("top", "", environment={"XDG_CONFIG_HOME": "/nowhere"}) == []


def test_services_of_a_type_are_listed(tmp_path):
    """By the type of the root object, and by what it implements: of a node, and of a gateway's devices."""
    port = free_port()
    robot = Background([BUILD / "examples" / "demo" / "rrgate-demo-create", "--port", port], tmp_path / "log")
    url = f"rr+tcp://127.0.0.1:{port}/?service=Create"
    gateway = None
    try:
        robot.wait_until(lambda: Ran(["info", url]).code == DONE)
        gateway = Gateway(tmp_path, {"devices": [{"name": "create", "url": url}, {"name": "nobody", "url": url.replace(str(port), "1")}]})
        gateway.wait_for("device online")
        base = f"http://127.0.0.1:{gateway.port}"
        own, above = "experimental.simulatedcreate.SimulatedCreate", "experimental.create2.Create"
        for where in url.split("?")[0], base:
            for wanted in own, above:
                (line,) = run("ls", where, "--type", wanted, "--json").splitlines()
                found = json.loads(line)
                assert (found["service"], found["type"]) == ("Create", own) and above in found["implements"]
            assert run("ls", where, "--type", "experimental.create2.Nothing") == ""
        assert own in run("ls", base) and len(run("ls", base).splitlines()) == 2
    finally:
        if gateway:
            gateway.process.stop()
        robot.stop()


def test_urls_may_begin_as_pages_write_them(guarded, tmp_path):
    admin = {"environment": {"RRGATE_PASSWORD": PASSWORDS["alice"]}}
    page = guarded.replace("http:", "ws:")
    base = page.split("/devices/")[0]
    assert run("get", page, "color", "--user", "alice", **admin).startswith("[")
    assert json.loads(run("info", page, "--json", "--user", "alice", **admin))
    assert json.loads(run("ls", base, "--json", "--user", "alice", **admin))["url"] == guarded
    shown = json.loads(run("top", base, "--count", "1", "--json", "--user", "alice", **admin))
    assert [each["device"] for each in shown["devices"]] == ["fox"]
    run("record", page, "-o", tmp_path / "fox.mcap", "--duration", "1", "--user", "alice", **admin)


def test_a_device_that_its_gateway_does_not_reach_is_named(tmp_path):
    nobody = f"rr+tcp://127.0.0.1:{free_port()}/?service=x"
    with running(tmp_path, {"devices": [{"name": "relayed", "url": nobody}, {"name": "shared", "url": nobody, "mode": "shared"}]}) as gateway:
        for name in "relayed", "shared":
            gateway.wait_for("device offline", device=name)
        for scheme in "http", "ws", "rr+ws":
            base = f"{scheme}://127.0.0.1:{gateway.port}/devices"
            for name in "relayed", "shared":
                assert Ran(["get", f"{base}/{name}?service=x", "a"]).refused(
                    UNREACHABLE, f": device '{name}' is offline: connect to ", ": Connection refused")
            assert Ran(["get", f"{base}/unknown?service=x", "a"]).refused(UNREACHABLE, "no device 'unknown'")


def test_a_device_with_users_of_its_own(tmp_path):
    """Asked directly, and by a gateway that has no users."""
    service, url = start_service(tmp_path)
    url = url.replace("service=interop", "service=guarded")
    right, wrong = ({"environment": {"RRGATE_PASSWORD": password}} for password in ("secret", "guess"))
    alice = ["get", url, "level", "--user", "alice"]
    try:
        assert run(*alice, **right) == "1.5"
        assert Ran(alice, **wrong).refused(REFUSED, "Authentication Failed")
        assert Ran(alice).refused(NOT_UNDERSTOOD, "RRGATE_PASSWORD")
        assert Ran(alice[:3]).refused(REFUSED, "Authentication Failed")
        with running(tmp_path, {"devices": [{"name": "relayed", "url": url}, {"name": "shared", "url": url, "mode": "shared"}]}) as gateway:
            for name in "relayed", "shared":
                gateway.wait_for("device online", device=name)
                there = f"http://127.0.0.1:{gateway.port}/devices/{name}?service=guarded"
                refusal = Ran(["get", there, "level", "--user", "alice"], **right)
                assert refusal.refused(REFUSED, "Authentication Failed; the login was for the gateway, and the device wants one of its own")
                assert "the login" not in Ran(["get", there, "level"]).error
    finally:
        service.stop()


def test_logins_and_rights_of_a_gateway(guarded):
    def as_user(name, password=None):
        return {"given": "", "environment": {"RRGATE_PASSWORD": password or PASSWORDS[name]}}

    assert run("get", guarded, "color", "--user", "vera", **as_user("vera")).startswith("[")
    assert Ran(["set", guarded, "color", "[1, 1, 1]", "--user", "vera"], **as_user("vera")).refused(REFUSED, "vera")
    run("set", guarded, "color", "[0, 0, 1]", "--user", "alice", **as_user("alice"))
    assert Ran(["get", guarded, "color", "--user", "vera"], **as_user("vera", "guess")).refused(REFUSED, "401")
    assert Ran(["get", guarded, "color"]).refused(REFUSED, "not logged in")
    assert Ran(["get", guarded, "color", "--user", "vera"]).refused(NOT_UNDERSTOOD, "RRGATE_PASSWORD")


def test_logins_are_kept_in_a_file(guarded, token, tmp_path):
    base = guarded.split("/devices/")[0]
    file = tmp_path / "rrgate" / "logins.json"
    file.parent.mkdir()
    environment = {"XDG_CONFIG_HOME": str(tmp_path)}

    def write(content, mode=0o600):
        file.write_text(content if isinstance(content, str) else json.dumps(content))
        file.chmod(mode)

    def is_refused(code, *words):
        return Ran(["get", guarded, "color"], environment=environment).refused(code, *words)

    alice = {"user": "alice", "password": PASSWORDS["alice"]}
    write({"gateways": {"https://other.lab": {"token": "x"}, base + "/": alice}})
    run("set", guarded, "color", "[0.5, 0.5, 1]", environment=environment)
    assert run("ls", base, environment=environment).endswith(guarded)
    write({"gateways": {base: {"token": token[1]}}})
    run("set", guarded, "color", "[0.5, 0.5, 1]", environment=environment)
    vera = {**environment, "RRGATE_PASSWORD": PASSWORDS["vera"]}  # what the command line says, holds
    assert Ran(["set", guarded, "color", "[1, 1, 1]", "--user", "vera"], environment=vera).refused(REFUSED, "vera")
    assert Ran(["get", guarded, "color"], environment={**environment, "RRGATE_TOKEN": "guess"}).refused(REFUSED, "401")
    vera["RRGATE_TOKEN"] = token[1]
    assert Ran(["set", guarded, "color", "[1, 1, 1]", "--user", "vera"], environment=vera).refused(REFUSED, "vera")
    write({"gateways": {base: {"token": "guess"}}})
    assert is_refused(REFUSED, "401")
    write({"gateways": {"http://127.0.0.1": alice}})  # another port
    assert is_refused(REFUSED, "not logged in")
    home = {"XDG_CONFIG_HOME": "", "HOME": str(tmp_path)}
    (tmp_path / ".config").mkdir()
    (tmp_path / ".config" / "rrgate").symlink_to(file.parent)
    write({"gateways": {base: alice}})
    assert run("get", guarded, "color", environment=home).startswith("[")

    write({"gateways": {base: alice}}, 0o640)
    assert is_refused(NOT_UNDERSTOOD, str(file), "others", "chmod 600")
    for content, word in ("{", "not JSON"), ({base: alice}, '"gateways"'), \
            ({"gateways": {"lab": alice}}, "'lab'"), ({"gateways": {base: {"user": "alice"}}}, '"password"'), \
            ({"gateways": {base: {"token": ""}}}, '"token"'):
        write(content)
        assert is_refused(NOT_UNDERSTOOD, str(file), word)


def test_a_gateway_for_one_device_needs_no_file(reynard, tmp_path):
    proxy = Background([RRGATE, "proxy", reynard, "--port", "0", "--name", "fox"], tmp_path / "log")
    try:
        base = proxy.next_line().split("rrgate proxy: ")[1].split("/ stands for")[0]
        found = base + "/devices/fox?service=reynard"
        proxy.wait_until(lambda: Ran(["get", found, "color"]).code == DONE)
        assert json.loads(run("ls", base, "--json"))["url"] == found
    finally:
        proxy.stop()
    proxy = Background([RRGATE, "proxy", reynard, "--port", "0", "--json"], tmp_path / "log")
    try:
        told = json.loads(proxy.next_line())
        assert told == {"url": told["url"], "device": reynard}
        proxy.wait_until(lambda: Ran(["get", f"{told['url']}devices/reynard?service=reynard", "color"]).code == DONE)
    finally:
        proxy.stop()
    assert Ran(["proxy", reynard, "--name", "a/b"]).refused(NOT_UNDERSTOOD, "'a/b'")


def test_a_gateway_for_one_device_logs_in_there(tmp_path):
    service, url = start_service(tmp_path)
    url = url.replace("service=interop", "service=guarded")
    command = ["proxy", url, "--port", "0", "--user", "alice"]
    try:
        for password, told in ("secret", None), ("guess", "the device refuses the gateway's login: "):
            proxy = Background([RRGATE, *command, "--json"], tmp_path / "log", {"RRGATE_PASSWORD": password})
            try:
                get = ["get", f"{json.loads(proxy.next_line())['url']}devices/guarded?service=guarded", "level"]
                proxy.wait_until(lambda: told in Ran(get).error if told else Ran(get).code == DONE)
            finally:
                proxy.stop()
        assert Ran(command).refused(NOT_UNDERSTOOD, "RRGATE_PASSWORD")
        assert Ran([*command, "--relay"]).refused(NOT_UNDERSTOOD, "--relay")
    finally:
        service.stop()
