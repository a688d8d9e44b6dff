"""Clients of the gateway's HTTP and WebSockets: requests, streams of events, upgrades."""
import http.client
import json
import os
import pathlib
import socket
import subprocess
import sys

BASE = "/api/v1/devices/interop/interop"  # of the test service, where the gateway calls its device "interop"
CLOSE = 8  # opcode of a WebSocket's frame
JSON_PROTOCOL = "rrgate.json.v1"
CLIENT = "127.0.0.2"  # an address that no proxy has


class Answer:
    def __init__(self, response):
        self.status, self.headers, self.body = response.status, response.headers, response.read()

    @property
    def json(self):
        return json.loads(self.body)


def ask(port, method, path, body=None, headers={}, base="", context=None, address="127.0.0.1"):
    """`body`: bytes as they are, or what becomes JSON. `context`: that of TLS, for HTTPS at localhost. `address`: the own one."""
    connection = http.client.HTTPSConnection("localhost", port, timeout=20, context=context) if context else \
        http.client.HTTPConnection("127.0.0.1", port, timeout=20, source_address=(address, 0))
    try:
        if body is not None and not isinstance(body, bytes):
            body, headers = json.dumps(body), {"Content-Type": "application/json", **headers}
        connection.request(method, base + path, body, headers)
        return Answer(connection.getresponse())
    finally:
        connection.close()


def upgrade_status(port, path, headers={}):
    """What an upgrade is answered with."""
    lines = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
    with socket.create_connection(("127.0.0.1", port), 10) as link:
        link.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                     f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{lines}\r\n".encode())
        received = b""
        while b"\r\n\r\n" not in received:
            chunk = link.recv(4096)
            assert chunk, received
            received += chunk
        return int(received.split()[1])


class Stream:
    """Server-sent events: (id, event, data) as they come."""

    def __init__(self, port, path, headers={}, base="", connection=None):
        self.connection = connection or http.client.HTTPConnection("127.0.0.1", port, timeout=20)
        self.connection.request("GET", base + path, headers={"Accept": "text/event-stream", **headers})
        self.response = self.connection.getresponse()
        assert self.response.status == 200, self.response.read()
        assert self.response.headers["Content-Type"] == "text/event-stream"
        assert self.response.readline() == b": connected\n"

    def next(self):
        fields = {}
        while True:
            line = self.response.readline().decode()
            if not line:
                raise EOFError("the stream has ended")
            line = line.rstrip("\n")
            if not line and "data" in fields:
                return fields.get("id"), fields.get("event"), json.loads(fields["data"])
            name, colon, value = line.partition(": ")
            if colon and name:
                fields[name] = value

    def close(self):
        # The response holds the socket as well: this is what ends the connection.
        self.response.close()
        self.connection.close()


def fetch(port, path, headers={}, address=CLIENT):
    """(status, headers, body)"""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10, source_address=(address, 0))
    try:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()
    finally:
        connection.close()


def open_websocket(port, path, headers=""):
    """A connected WebSocket as a socket; what comes first was the 101."""
    link = socket.create_connection(("127.0.0.1", port), 10, source_address=(CLIENT, 0))
    link.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                 f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{headers}\r\n".encode())
    head = b""
    while b"\r\n\r\n" not in head:
        chunk = link.recv(4096)
        assert chunk, head
        head += chunk
    assert head.startswith(b"HTTP/1.1 101 "), head
    return link


def is_alive(link):
    """Whether a WebSocket stays open: no end of it comes, nor the frame by which the other side closes."""
    link.settimeout(0.3)
    said = b""
    try:
        while chunk := link.recv(4096):
            said += chunk
    except TimeoutError:
        return CLOSE not in opcodes(said)
    return False


def opcodes(data):
    """Of whole frames from a server."""
    while data:
        yield data[0] & 0x0F
        length, head = data[1] & 0x7F, 2
        if length >= 126:
            head += 2 if length == 126 else 8
            length = int.from_bytes(data[2:head], "big")
        data = data[head + length:]


def schemathesis(folder, port, document, *more):
    """Every operation of a document with what its schema allows and what it doesn't: no fault, nothing undocumented.
    `more` are further arguments. The same requests each time, unless RRGATE_SEED names others."""
    program = pathlib.Path(sys.executable).parent / "schemathesis"
    checks = "not_a_server_error,status_code_conformance,content_type_conformance,response_schema_conformance"
    run = subprocess.run(
        [program, "run", f"http://127.0.0.1:{port}{document}", "--url", f"http://127.0.0.1:{port}", "--checks", checks,
         "--max-examples", "20", "--seed", os.environ.get("RRGATE_SEED", "1"), "--no-color", *more], cwd=folder, capture_output=True, text=True, timeout=100)
    # A request may be long: why it failed stands before it.
    assert run.returncode == 0, "\n".join(line[:300] for line in run.stdout.splitlines()[-120:]) + run.stderr[-2000:]
    return run.stdout
