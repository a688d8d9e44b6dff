"""Certificates, users and rights that change while clients of every kind are at work: nobody is cut off, and who comes
next is judged by the new files."""
import contextlib
import http.client
import json
import shutil
import ssl
import sys
import threading
import time

import issuers
import pytest
import RobotRaconteur as RR
from websockets.sync.client import connect

from directions import LEVELS, PEERS
from gateways import Gateway, rrgate
from http_api import JSON_PROTOCOL, Answer, Stream
from news import PATIENCE
from processes import Background, free_port
from tls_nodes import SERVICE, start_service
from users import PASSWORDS, basic, make_users

READING = [
    {"roles": ["viewer", "guest"], "may": ["read", "subscribe"]},
    {"roles": ["guest"], "devices": ["relayed"], "may": ["read", "write", "call", "subscribe", "lock"]},
    {"roles": ["viewer"], "members": ["fire"], "may": ["call"]},
]
WRITING = [*READING, {"roles": ["viewer"], "members": ["p_double"], "may": ["write"]}]
VALUE = "/api/v1/devices/shared/interop/p_double"

# As systemd hands sockets over: from number 3 on, for this process.
HAND_OVER = """
import os, socket, sys
v4 = socket.create_server(("127.0.0.1", int(sys.argv[1])))
v6 = socket.create_server(("::1", int(sys.argv[2])), family=socket.AF_INET6)
taken = [os.dup(one.fileno()) for one in (v4, v6)]
taken = [os.dup(one) if one in (3, 4) else one for one in taken]
for number, one in enumerate(taken, 3):
    os.dup2(one, number)
os.environ.update(LISTEN_FDS="2", LISTEN_PID=str(os.getpid()))
os.execv(sys.argv[3], sys.argv[3:])
"""


@pytest.fixture(scope="module")
def devices(lab, tmp_path_factory):
    folder = tmp_path_factory.mktemp("devices")
    shared = Background([sys.executable, PEERS / "service.py"], folder / "shared.log")
    relayed, port = start_service("ours", lab, "good", folder, *LEVELS["v4"])
    yield json.loads(shared.next_line())["url"], f"rrs+tcp://127.0.0.1:{port}/?nodeid={SERVICE}&service=interop"
    shared.stop()
    relayed.stop()


class Site:
    """A gateway on two addresses, with everything that can be read anew."""

    def __init__(self, folder, devices, device_ca, is_handed_over):
        self.folder = folder
        shared, relayed = devices
        rrgate("cert", "ca", folder / "web")
        self.renew()
        shutil.copy(device_ca, folder / "device-ca.pem")
        make_users(folder)
        self.people = issuers.People(folder / "people")
        shutil.copy(self.people.ca, folder / "client-ca.pem")
        self.port, self.port_v6 = free_port(), free_port()
        self.access = {"users_file": "users", "client_ca": ["client-ca.pem"], "anonymous_role": "guest",
                       "grants": [{"users": ["wendy", "walter"], "roles": ["viewer"]}], "rules": READING}
        config = {
            "listen": [f"127.0.0.1:{self.port}", f"[::1]:{self.port_v6}"],
            "devices": [{"name": "shared", "url": shared, "mode": "shared"},
                        {"name": "relayed", "url": relayed, "tls": {"ca": ["device-ca.pem"]}}],
            "tls": {"certificates": [{"cert": "web/localhost.pem", "key": "web/localhost.key"}]},
            "access": self.access,
        }
        command = [sys.executable, "-c", HAND_OVER, self.port, self.port_v6] if is_handed_over else []
        self.gateway = Gateway(folder, config, command=command)
        self.gateway.wait_for("device online", device="relayed")
        self.gateway.wait_for("session open", service="interop")

    def renew(self):
        rrgate("cert", "web", self.folder / "web", "localhost", "127.0.0.1", "::1", "--force")

    def context(self, *certificate):
        made = ssl.create_default_context(cafile=self.folder / "web" / "web-ca.pem")
        if certificate:
            made.load_cert_chain(*certificate)
        return made

    def https(self, *certificate, host="127.0.0.1"):
        port = self.port if host == "127.0.0.1" else self.port_v6
        return http.client.HTTPSConnection(host, port, timeout=PATIENCE, context=self.context(*certificate))

    def serials(self):
        """Of the certificates that both addresses show."""
        shown = []
        for host in ("127.0.0.1", "::1"):
            with contextlib.closing(self.https(host=host)) as made:
                made.connect()
                shown.append(made.sock.getpeercert()["serialNumber"])
        return shown


class Client(threading.Thread):
    """Exchanges one thing after another over one connection, which is never opened again."""

    def __init__(self, name, exchange, close):
        super().__init__(name=name, daemon=True)
        self.exchange, self.close = exchange, close
        self.done, self.failure = 0, None
        self.is_wanted = True

    def run(self):
        try:
            while self.is_wanted:
                self.exchange(self.done)
                self.done += 1
                time.sleep(0.002)
        except BaseException as failure:
            self.failure = failure


def request(connection, method, path, body=None, headers={}):
    connection.auto_open = 0  # a connection that is lost is a failure
    if body is not None:
        body, headers = json.dumps(body), {"Content-Type": "application/json", **headers}
    connection.request(method, path, body, headers)
    return Answer(connection.getresponse())


def http_client(name, connection, headers={}):
    connection.connect()

    def exchange(_):
        answer = request(connection, "GET", VALUE, headers=headers)
        assert answer.status == 200, answer.body
    client = Client(name, exchange, connection.close)
    client.connection, client.headers = connection, headers
    return client


def json_client(name, url, **options):
    connecting = connect(url + "/api/v1/devices/shared/interop", subprotocols=[JSON_PROTOCOL], **options)
    socket = connecting.__enter__()

    def exchange(number):
        socket.send(json.dumps({"id": number, "op": "get", "path": "p_double"}))
        answer = json.loads(socket.recv(timeout=PATIENCE))
        assert answer["id"] == number and "result" in answer, answer
    return Client(name, exchange, socket.close)


def event_client(name, site, headers):
    stream = Stream(site.port, "/changed", headers, "/api/v1/devices/shared/interop", site.https())
    caller = site.https()
    caller.connect()

    def exchange(_):
        answer = request(caller, "POST", "/api/v1/devices/shared/interop/fire", {"count": 1}, headers)
        assert answer.status == 200, answer.body
        assert stream.next()[2] == {"value": 0.0, "why": "number 0"}

    def close():
        stream.close()
        caller.close()
    return Client(name, exchange, close)


def rr_client(name, node, *login):
    root = node.ConnectService(name, *login)

    def exchange(_):
        assert isinstance(root.p_double, float)
    client = Client(name, exchange, lambda: node.DisconnectService(root))
    client.root = root
    return client


@contextlib.contextmanager
def all_at_work(site, node):
    port, vera = site.port, basic("vera")
    wendy = site.people.certificate("wendy")
    clients = [
        http_client("http", http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE), vera),
        http_client("https", site.https(), vera),
        http_client("https to IPv6", site.https(host="::1"), vera),
        http_client("https with a certificate", site.https(*wendy)),
        json_client("json over ws", f"ws://127.0.0.1:{port}", additional_headers=vera),
        json_client("json over wss", f"wss://localhost:{port}", additional_headers=vera, ssl=site.context()),
        event_client("events over https", site, vera),
        rr_client(f"rr+tcp://127.0.0.1:{port}/?nodename=shared&service=interop", node),
        rr_client(f"rr+tcp://[::1]:{site.port_v6}/?nodename=shared&service=interop", node, "vera",
                  {"password": RR.VarValue(PASSWORDS["vera"], "string")}),
        rr_client(f"rr+wss://localhost:{port}/devices/shared?service=interop", node),
        rr_client(f"rr+tcp://127.0.0.1:{port}/?nodeid={SERVICE}&service=interop", node),
        rr_client(f"rr+ws://127.0.0.1:{port}/devices/relayed?service=interop", node),
        rr_client(f"rr+wss://localhost:{port}/devices/relayed?service=interop", node),
    ]
    try:
        for client in clients:
            client.start()
        yield clients
    finally:
        for client in clients:
            client.is_wanted = False
        for client in clients:
            client.join(PATIENCE)
            with contextlib.suppress(Exception):
                client.close()


def all_go_on(clients):
    """Each one does ten more things."""
    wanted = [client.done + 10 for client in clients]
    deadline = time.monotonic() + PATIENCE
    while any(client.done < count for client, count in zip(clients, wanted)):
        for client in clients:
            assert client.failure is None, f"{client.name}: {client.failure!r}"
        assert time.monotonic() < deadline, [(client.name, client.done) for client in clients]
        time.sleep(0.01)


@pytest.mark.parametrize("is_handed_over", [False, True], ids=["its own sockets", "sockets of systemd"])
def test_files_that_change_under_load(lab, devices, node, tmp_path, monkeypatch, is_handed_over):
    monkeypatch.setenv("SSL_CERT_FILE", str(tmp_path / "web" / "web-ca.pem"))
    site = Site(tmp_path, devices, lab / "ca.pem", is_handed_over)
    gateway = site.gateway
    try:
        with all_at_work(site, node) as clients:
            all_go_on(clients)

            # The certificate of HTTPS, seen by the watch of its files.
            before = site.serials()
            assert before[0] == before[1]
            site.renew()
            deadline = time.monotonic() + PATIENCE
            while before[0] in (shown := site.serials()):
                assert time.monotonic() < deadline
                time.sleep(0.05)
            assert shown[0] == shown[1]
            all_go_on(clients)
            rr_client(f"rr+wss://localhost:{site.port}/devices/relayed?service=interop", node).close()

            # The CA of people, by a signal: who comes next is known by the new one alone.
            others = issuers.People(tmp_path / "others")
            walter, wendy = others.certificate("walter"), site.people.certificate("wendy")
            (tmp_path / "client-ca.pem").write_bytes(others.ca.read_bytes())
            gateway.hang_up()
            gateway.wait_for("configuration read anew")
            with contextlib.closing(site.https(*walter)) as made:
                made.connect()
                assert request(made, "GET", "/api/v1/access").json["user"] == "walter"
            with pytest.raises((ssl.SSLError, ConnectionError)), contextlib.closing(site.https(*wendy)) as made:
                made.connect()
                request(made, "GET", "/api/v1/access")
            all_go_on(clients)

            # Rights: connections that are open have them at once.
            session = next(client.root for client in clients if "[::1]" in client.name)

            def may_write(number):
                with contextlib.closing(site.https()) as made:
                    made.connect()
                    status = request(made, "PUT", VALUE, float(number), basic("vera")).status
                try:
                    session.p_double = float(number)
                    is_set = True
                except RR.PermissionDeniedException:
                    is_set = False
                assert {204: True, 403: False}[status] is is_set
                return is_set

            assert not may_write(1)
            gateway.write({**gateway.config, "access": {**site.access, "rules": WRITING}})
            gateway.wait_for("configuration read anew", 2)
            assert may_write(2)
            gateway.write({**gateway.config, "access": {**site.access, "rules": READING}})
            gateway.wait_for("configuration read anew", 3)
            assert not may_write(3)
            all_go_on(clients)

            # The CA of a device: its sessions go on, and no new one begins with a node that can't be believed.
            good = (tmp_path / "device-ca.pem").read_bytes()
            url = f"rr+tcp://127.0.0.1:{site.port}/?nodeid={SERVICE}&service=interop"
            (tmp_path / "device-ca.pem").write_bytes(site.people.ca.read_bytes())
            gateway.wait_for("device offline", device="relayed")
            with pytest.raises(RR.ConnectionException):
                rr_client(url, node).close()
            all_go_on(clients)
            (tmp_path / "device-ca.pem").write_bytes(good)
            gateway.wait_for("device online", 2, device="relayed")
            rr_client(url, node).close()
            all_go_on(clients)

            # A bad file of each kind changes nothing.
            for name in ("web/localhost.pem", "client-ca.pem", "users", "device-ca.pem"):
                (tmp_path / name).write_text("not what it should be\n")
            gateway.hang_up()
            gateway.wait_for("configuration not used; that from before stays")
            assert site.serials() == shown
            all_go_on(clients)
    finally:
        code = gateway.process.stop()
    assert code == 0, gateway.process.description()
