"""What all commands of rrgate have in common, found by walking through their help: --json, exit codes, and how they refuse."""
import json
import re
import resource
import signal
import subprocess

import pytest

from command_line import DONE, FAILED, NOT_UNDERSTOOD, UNREACHABLE, Ran, run
from gateways import RRGATE
from processes import ROOT, free_port

JSON_RPC = {"rrgate mcp"}  # what it prints is a protocol in JSON already
DEFINITION = "service org.test.lamp\n\nstdver 0.10\n\nobject Lamp\n    property double brightness\nend\n"


def commands_below(*words):
    """Each command that does something, as the words that call it."""
    names = re.findall(r"^  ([a-z][a-z-]+)  +[A-Z]", run(*words, "--help"), re.M)
    return [command for name in names for command in commands_below(*words, name)] if names else [words]


COMMANDS = commands_below()


def test_the_commands_are_found():
    assert {("ls",), ("init",), ("cert", "ca"), ("generate", "cpp"), ("completion",)} <= set(COMMANDS) and len(COMMANDS) > 25


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_command_has_json_and_says_its_exit_codes(command):
    text = run(*command, "--help")
    name = " ".join(("rrgate", *command))
    assert (re.search(r"^  --json +\S", text, re.M) is not None) == (name not in JSON_RPC), text
    codes = re.findall(r"\b(\d) \w", text.split("Exit codes: ")[1])
    assert codes == [str(number) for number in range(len(codes))] and len(codes) in (3, 4, 6), text
    if "--timeout" in text:
        assert len(codes) == 6, text


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_an_unknown_option_is_refused_in_one_sentence(command):
    assert Ran([*command, "--no-such-option"]).refused(NOT_UNDERSTOOD, " ".join(("rrgate", *command)), "--help")


def test_the_page_has_the_exit_codes_of_the_help():
    section = (ROOT / "docs/command-line.md").read_text().split("## Exit codes")[1]
    codes = re.findall(r"^\| (\d) \|", section, re.M)
    assert codes == re.findall(r"\b(\d) \w", run("get", "--help").split("Exit codes: ")[1])


def test_codes_are_as_they_say(tmp_path):
    bad = tmp_path / "bad.robdef"
    bad.write_text("service\n")
    assert Ran(["check", bad]).code == FAILED
    assert Ran(["get", f"rr+tcp://127.0.0.1:{free_port()}/?service=x", "y", "--json"]).refused(UNREACHABLE)
    assert Ran(["passwd", tmp_path / "users", "a:b", "--json"]).refused(NOT_UNDERSTOOD, "'a:b'")


def told(*command, **more):
    return json.loads(run(*command, "--json", **more))


def test_init_tells_all_that_it_made(tmp_path):
    folder = tmp_path / "lab"
    made = told("init", folder, "--user", "root")
    assert made["config"] == str(folder / "gateway.json") and made["user"] == "root"
    assert re.fullmatch("[a-z2-9]{20}", made["password"])
    assert {"localhost", "127.0.0.1"} <= set(made["names"])
    assert made["url"] == f"https://{made['names'][0]}:8443/"
    assert sorted(made["files"]) == sorted(str(path) for path in folder.rglob("*") if path.is_file())
    assert made["web_ca"] == str(folder / "tls/web-ca.pem") and made["web_ca"] in made["files"]
    assert told("check-config", made["config"])["good"]
    assert Ran(["init", folder, "--json"]).refused(FAILED, "rrgate init: ", "nothing was written")


def test_init_tells_people_the_same(tmp_path):
    said = run("init", tmp_path / "lab")
    for words in ("tls/node-ca.pem", "tls/web-ca.pem", "The .key files", "keep them secret, and off the gateway's machine",
                  "user admin, password ", "https://", "Next: put your devices into"):
        assert words in said, words
    assert "node-ca.key" not in said


def test_users_and_tokens(tmp_path):
    users, tokens = str(tmp_path / "users"), str(tmp_path / "tokens")
    for more, change in ([], "added"), ([], "changed"), (["--delete"], "deleted"):
        assert told("passwd", users, "alice", *more, given="secret\n") == {"file": users, "user": "alice", "change": change}
    made = told("token", tokens, "ci", "--roles", "viewer")
    assert made == {"file": tokens, "name": "ci", "change": "added", "token": made["token"]} and len(made["token"]) > 20
    assert told("token", tokens, "ci", "--delete") == {"file": tokens, "name": "ci", "change": "deleted"}


def test_certificates(tmp_path):
    made = told("cert", "ca", tmp_path)
    assert made == {"files": [f"{tmp_path}/{name}" for name in ("node-ca.pem", "node-ca.key", "web-ca.pem", "web-ca.key")]}
    made = told("cert", "web", tmp_path, "gateway.lab", "192.0.2.7")
    assert made == {"hosts": ["gateway.lab", "192.0.2.7"], "files": [f"{tmp_path}/gateway.lab.pem", f"{tmp_path}/gateway.lab.key"]}
    node = "{01234567-89ab-cdef-0123-456789abcdef}"
    made = told("cert", "node", tmp_path, node, "--output", tmp_path)
    assert made["node"].strip("{}") == node.strip("{}") and made["files"] == [f"{tmp_path}/{made['node']}.p12"]
    assert (tmp_path / f"{made['node']}.p12").is_file()


def test_service_definitions(tmp_path):
    good, loose, bad = (tmp_path / name for name in ("org.test.lamp.robdef", "loose.robdef", "bad.robdef"))
    good.write_text(DEFINITION)
    loose.write_text(DEFINITION.replace("    property", "  property"))
    bad.write_text("service\n")
    assert told("fmt", loose) == {"file": str(loose), "text": run("fmt", loose) + "\n\n"}
    ran = Ran(["fmt", "--check", "--json", good, loose])
    assert ran.code == FAILED
    assert [json.loads(line)["formatted"] for line in ran.out.splitlines()] == [True, False]
    assert told("fmt", "--in-place", loose) == {"file": str(loose), "changed": True}
    assert told("fmt", "--in-place", loose) == {"file": str(loose), "changed": False}
    ran = Ran(["fmt", "--json", bad])
    assert (ran.code, json.loads(ran.out.splitlines()[0])["severity"], ran.error) == (FAILED, "error", "")
    assert "interface Lamp" in told("generate", "ts", good)["text"]
    assert told("generate", "ts", good, "-o", tmp_path / "lamp.ts") == {"file": str(tmp_path / "lamp.ts")}
    files = [json.loads(line)["file"] for line in run("generate", "cpp", good, "-o", tmp_path, "--json").splitlines()]
    assert [file.rsplit(".", 1)[1] for file in files] == ["hpp", "cpp"]


def test_definitions_come_by_standard_input(own_service):
    """One, or all that a service has, of which some import others."""
    _, url = own_service
    assert run("check", "-", given=DEFINITION) == "-: good; org.test.lamp"
    loose = DEFINITION.replace("    property", "  property")
    assert run("fmt", "-", given=loose) == DEFINITION.strip()
    for option in "--check", "--in-place":
        assert Ran(["fmt", option, "-"], given=loose).refused(NOT_UNDERSTOOD, "standard input")
    assert "interface Lamp" in run("generate", "ts", "-", given=DEFINITION)
    several = run("robdef", url)
    names = re.findall(r"^service (\S+)", several, re.M)
    assert len(names) > 0
    pair = "# The first.\nservice org.test.light\n\nstdver 0.10\n\nstruct Light\n    field double red\nend\n\n# The second.\n" + \
        DEFINITION.replace("object", "import org.test.light\n\nobject").replace("double brightness", "org.test.light.Light light")
    assert run("check", "-", given=pair).splitlines() == ["-: good; org.test.light", "-: good; org.test.lamp"]
    assert run("check", "--compat", "-", given=several).splitlines() == [f"-: good; {name}" for name in names]
    wrong = Ran(["check", "-"], given=pair.replace("light.Light light", "light.Dark light"))
    line = 1 + pair[:pair.index("property")].count("\n")
    assert wrong.code == FAILED and wrong.error.startswith(f"-:{line}:"), wrong.error
    ran = Ran(["fmt", "-"], given=pair.replace("property", "proprety"))
    assert ran.code == FAILED and ran.error.startswith(f"-:{line}:") and ran.out.startswith("service org.test.light\n")
    types = run("generate", "ts", "-", given=pair)
    assert "interface Lamp" in types and "interface Light" in types


def test_a_configuration_comes_by_standard_input(tmp_path):
    config = {"listen": ["127.0.0.1:1"], "devices": []}
    assert run("check-config", "-", given=json.dumps(config)) == "-: good; 0 devices"
    ran = Ran(["check-config", "-"], given=json.dumps({**config, "listen": ["8080"]}))
    assert ran.code == NOT_UNDERSTOOD and ran.error.startswith("-: /listen/0: ")
    assert Ran(["check-config", "-", "--as-service", "root"], given="{}").refused(NOT_UNDERSTOOD, "standard input")


def test_a_definition_is_whole_while_it_is_formatted(tmp_path):
    file, link = tmp_path / "lamp.robdef", tmp_path / "link.robdef"
    loose = DEFINITION.replace("    property", "  property")
    file.write_text(loose)
    file.chmod(0o640)
    link.symlink_to(file)
    with open(file) as reader:
        run("fmt", "--in-place", link)
        assert reader.read() == loose
    assert file.read_text() == DEFINITION and file.stat().st_mode & 0o777 == 0o640 and link.is_symlink()
    file.write_text(loose)
    full = subprocess.run([RRGATE, "fmt", "--in-place", file], preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (8, 8)),
                          restore_signals=False, capture_output=True, text=True)
    assert (full.returncode, full.stderr) == (FAILED, f"{file}: error: cannot be written\n")
    assert file.read_text() == loose and sorted(tmp_path.iterdir()) == [file, link]


def test_what_could_not_be_printed_is_a_failure(tmp_path):
    def run_into_full_disk(*command):
        with open("/dev/full", "w") as full:
            return subprocess.run([RRGATE, *map(str, command)], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)

    for name, *more in ["ci"], ["other", "--json"]:
        ran = run_into_full_disk("token", tmp_path / "tokens", name, *more)
        assert ran.returncode == FAILED and ran.stderr.endswith("rrgate token: standard output can't be written\n")
    assert run_into_full_disk("fmt", tmp_path / "none.robdef").stderr.count("\n") == 1
    assert run_into_full_disk("token", tmp_path / "tokens", "ci", "--delete", "--json").returncode == FAILED


def test_completions():
    made = told("completion", "bash")
    assert made == {"shell": "bash", "script": made["script"]}
    assert made["script"].strip() == run("completion", "bash")
    assert json.loads(run("completion", "words", "--json", "--", "che")) == {"words": ["check-config", "check"]}


def test_the_gateway_tells_its_addresses(tmp_path):
    config = tmp_path / "gateway.json"
    config.write_text(json.dumps({"listen": ["127.0.0.1:0"], "devices": []}))
    with subprocess.Popen([RRGATE, "serve", config, "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as gateway:
        try:
            (address,) = json.loads(gateway.stdout.readline())["listen"]
            assert told("health", address)["good"]
        finally:
            gateway.send_signal(signal.SIGTERM)
    assert gateway.returncode == DONE
