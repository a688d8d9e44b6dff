"""No request hides in another one: the gateway reads none where a proxy before it, or nobody, has seen one."""
import re
import select
import socket

import pytest

from http_api import ask
from processes import start_gateway
from reverse_proxies import PROXIES, ReverseProxy
from smuggling import PLAIN, attacks, hidden, origin, post

NAMES = list(attacks(0))


@pytest.fixture(scope="module")
def gateway(device, tmp_path_factory):
    """(port, log) of a gateway that trusts the proxies of this machine."""
    folder = tmp_path_factory.mktemp("gateway")
    process, port = start_gateway(folder, device, trusted_proxies=["127.0.0.1"], limits={"header_timeout_ms": 1000})
    yield port, folder / "gateway.log"
    process.stop()


@pytest.fixture(scope="module", params=list(PROXIES))
def proxy(request, gateway, tmp_path_factory):
    running = ReverseProxy(request.param, PROXIES[request.param], tmp_path_factory.mktemp(request.param), gateway[0])
    yield running
    running.stop()


def send(port, raw):
    """What comes back until the other end closes, or has been silent for a while."""
    received = b""
    with socket.create_connection(("127.0.0.1", port), 10) as link:
        try:
            link.sendall(raw)
            while select.select([link], [], [], 0.4)[0]:
                chunk = link.recv(65536)
                if not chunk:
                    break
                received += chunk
        except (ConnectionResetError, BrokenPipeError):
            pass
    return received


def statuses(received):
    return [int(status) for status in re.findall(rb"HTTP/1\.[01] (\d\d\d)[ \r]", received) if not status.startswith(b"1")]


def took(log, number):
    """Whether the gateway has taken the hidden request for one."""
    return origin(number).encode() in log.read_bytes()


def test_a_hidden_request_would_be_seen(gateway):
    """Two requests, one after the other, are two."""
    port, log = gateway
    assert statuses(send(port, post(b"Content-Length: 2\r\n", b"{}") + hidden("none"))) == [409, 403]
    assert took(log, "none")


@pytest.mark.parametrize("name", NAMES)
def test_directly(gateway, name):
    port, log = gateway
    number = f"direct{NAMES.index(name)}"
    received = send(port, attacks(number)[name])
    status, = statuses(received)
    assert (status in (400, 413, 431, 501)) != (name in PLAIN), received
    assert not took(log, number)
    assert ask(port, "GET", "/healthz").status == 200


def test_through_a_proxy(gateway, proxy):
    """What the gateway takes for a request, the client has got an answer to: the proxy saw it, too. And whoever comes next
    gets his own answer, not that of a request that somebody else has hidden."""
    port, log = gateway
    wrong = []
    for index, name in enumerate(NAMES):
        number = f"{proxy.name}{index}"
        received = send(proxy.root, attacks(number)[name])
        for each in range(3):
            path = f"/api/next-{number}-{each}"
            answer = ask(proxy.root, "GET", path)
            if answer.status != 404 or path not in answer.json["detail"]:
                wrong.append((name, "the next client got", answer.status, answer.body))
        if took(log, number) and len(statuses(received)) < 2:
            wrong.append((name, "the gateway saw two requests, the client one answer", received))
    assert wrong == []
    assert ask(port, "GET", "/healthz").status == 200
