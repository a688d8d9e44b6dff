"""The commands of each page, run in their order as they stand there; what they print is what the page says."""
import pathlib
import re
import sys
import tempfile

import pytest

import not_run
from machine import need
from pages import ROOT, blocks, find, pages, unknown
from shell import Shell, commands_of, looks_like, trace

# What a page takes for granted, beside the blocks that are run.
BEFORE = {
    "docs/recording.md": [f"{sys.executable} -m reynard_the_robot --quiet"],
    "README.md": ["rrgate demo"],
    "docs/http-api.md": ["rrgate demo"],
    "docs/start.md": ["rrgate demo"],
    "docs/tutorials/page.md": ["build-examples/thermostat_device", "mkdir examples/thermostat/node_modules",
                               "ln -s $PWD/wasm-client examples/thermostat/node_modules/rrgate-client"],
    "docs/tutorials/robot.md": ["rrgate demo", "mkdir node_modules", "ln -s $PWD/wasm-client node_modules/rrgate-client"],
    "docs/tutorials/standard-robot.md": ["rrgate demo baxter --port 8080", "mkdir node_modules",
                                         "ln -s $PWD/wasm-client node_modules/rrgate-client"],
}
RUNS_JAVASCRIPT = ("docs/tutorials/robot.md", "docs/tutorials/standard-robot.md")


@pytest.fixture
def folder():
    with tempfile.TemporaryDirectory(prefix="rr-docs-") as short:  # it is part of the paths of sockets
        yield pathlib.Path(short)


def is_run(block):
    return block.language == "sh" and find(not_run.COMMANDS, block) is None or \
        block.language == "js" and block.page in RUNS_JAVASCRIPT


@pytest.mark.parametrize("page", [page for page in pages() if any(is_run(block) for block in blocks() if block.page == page)])
def test_page(page, folder):
    need("network")
    shell = Shell(folder)
    try:
        for command in BEFORE.get(page, ()):
            assert shell.run(command)[1] == 0, command
        for block in (block for block in blocks() if block.page == page):
            if block.language == "json" and '"listen"' in block.text and not block.file:
                (folder / "gateway.json").write_text(block.text)
            elif is_run(block):
                follow(shell, block)
    finally:
        shell.end()


def follow(shell, block):
    if block.language == "js":
        (shell.folder / "block.mjs").write_text(block.text)
        said, code = shell.run("timeout 20 node block.mjs")
        assert code == 0, f"{block}: node ended with {code}\n{said}"
        return
    for command, expected in commands_of(block.text):
        said, code = shell.run(command)
        if not expected:
            assert code == 0, f"{block}: {command}\nended with {code}, and said\n{said}{trace(shell.folder)}"
        if expected is None:
            continue
        if is_in(not_run.NUMBERS_DIFFER, block, command):
            said, expected = (re.sub(r"\d+(\.\d+)?", "0", text) for text in (said, expected))
        assert looks_like(expected, said), f"{block}: {command}\nsaid\n{said}\nexpected\n{expected}{trace(shell.folder)}"


def is_in(listed, block, command):
    return any(page == block.page and command.startswith(beginning) for page, beginning in listed)


def test_python_comes_from_a_folder_of_its_own():
    """Debian has no "python", and its pip refuses to install beside its packages."""
    commands = [command for block in blocks() if block.language == "sh" for command, _ in commands_of(block.text)]
    words = [re.split(r"&&|\||;", command) for command in commands]
    found = [part.strip() for parts in words for part in parts if re.match(r"\s*(pip3?|python|python3 -m pip)\b", part)]
    assert commands and found == []


def test_containers_are_published_to_this_machine():
    """What Docker publishes passes the firewall of the host, and the page has no TLS."""
    published = [port for text in pages().values() for port in re.findall(r"docker run\b[^`]*?\s-p\s+(\S+)", text)]
    assert len(published) > 3 and [port for port in published if not port.startswith("127.0.0.1:")] == []


def test_packages_are_where_the_script_puts_them():
    version = re.search(r"^project\(rrgate VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
    named = [name for block in blocks() if block.language == "sh" for name in re.findall(r"apt install (\S+)", block.text)]
    assert set(named) == {f"./build/package/rrgate_{version}_amd64.deb"}
    assert "\npackages=$PWD/build/package\n" in (ROOT / "dev").read_text()


def test_what_is_not_run_is_there():
    assert unknown(not_run.COMMANDS) == []


def test_output_is_compared():
    assert looks_like("", "")
    assert looks_like('{"x":...,"y":...}', '{"x":1.5,"y":2}')
    assert looks_like("a\n...\nc", "a\nb\nb\nc")
    assert not looks_like("a", "a\nb")
    assert not looks_like("a...", "b")
    assert commands_of("$ a \\\n  b\none\ntwo\n$ c\n") == [("a \\\n  b", "one\ntwo"), ("c", "")]
    assert commands_of("# why\na\nb # c\n") == [("a", None), ("b # c", None)]
