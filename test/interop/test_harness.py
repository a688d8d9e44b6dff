"""The helpers of these tests: what they are for is seen, and what they watch does not fail unseen."""
import ast
import pathlib
import socket

import pytest

from http_api import is_alive
from news import under_load

PING, TEXT, CLOSE = b"\x89\x00", b"\x81\x7e\x01\x00" + bytes(256), b"\x88\x12\x03\xe9left the gateway"


@pytest.mark.parametrize("said, expected", [
    (b"", True), (PING, True), (TEXT + PING, True), (CLOSE, False), (PING + CLOSE, False), (TEXT + CLOSE, False), (None, False)])
def test_a_link_that_is_told_to_close_is_not_alive(said, expected):
    here, there = socket.socketpair()
    with here, there:
        if said is None:
            there.close()
        else:
            there.sendall(said)
        assert is_alive(here) is expected


def test_load_that_fails_is_noticed():
    count = 0

    def exchange():
        nonlocal count
        count += 1
        if count > 5:
            raise ConnectionError("lost")

    with pytest.raises(ConnectionError), under_load(exchange):
        pass


def test_load_goes_on_all_the_time():
    calls = []
    with under_load(lambda: calls.append(1), threads=2):
        assert len(calls) >= 2
        before = len(calls)
    assert len(calls) >= before + 2


def test_no_test_imports_another_one():
    """What several need is a helper's or a fixture."""
    found = []
    for path in pathlib.Path(__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [each.name for each in node.names] if isinstance(node, ast.Import) else \
                [node.module] if isinstance(node, ast.ImportFrom) else []
            found += [f"{path.name}: {name}" for name in names if name.startswith("test_")]
    assert found == []
