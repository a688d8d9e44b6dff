"""rrgate with certificates: making them, HTTPS on the one port, reloading. Usage: https_test.py PATH_TO_RRGATE"""
import base64
import json
import os
import re
import shutil
import signal
import socket
import ssl
import stat
import subprocess
import sys
import tempfile
import time
import unittest

RRGATE = sys.argv.pop()
PATIENCE = 20.0  # seconds


def run(*arguments, **environment):
    return subprocess.run([RRGATE, *arguments], capture_output=True, text=True, timeout=PATIENCE,
                          env={**os.environ, **environment})


class Lab(unittest.TestCase):
    """A CA, a certificate for two names, one for a third."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.lab = os.path.join(cls.folder, "lab")
        for arguments in [("ca", cls.lab), ("web", cls.lab, "localhost", "127.0.0.1"), ("web", cls.lab, "other.example")]:
            result = run("cert", *arguments)
            assert result.returncode == 0, result.stderr

    def path(self, name):
        return os.path.join(self.lab, name)


class Making(Lab):
    def config_folder(self, name):
        folder = os.path.join(self.folder, name)
        return folder, {"ROBOTRACONTEUR_SYSTEM_CONFIG_DIR": folder, "ROBOTRACONTEUR_USER_CONFIG_DIR": folder}

    def test_only_the_owner_may_read(self):
        self.assertEqual(stat.S_IMODE(os.stat(self.lab).st_mode), 0o700)
        for name in os.listdir(self.lab):
            self.assertEqual(stat.S_IMODE(os.stat(self.path(name)).st_mode), 0o600, name)

    def test_nothing_is_replaced_unless_forced(self):
        with open(self.path("node-ca.pem")) as file:
            before = file.read()
        for arguments in [("ca", self.lab), ("web", self.lab, "other.example")]:
            result = run("cert", *arguments)
            self.assertEqual(result.returncode, 1)
            self.assertIn("is there already; --force replaces it", result.stderr)
        with open(self.path("node-ca.pem")) as file:
            self.assertEqual(file.read(), before)
        self.assertEqual(run("cert", "web", self.lab, "other.example", "--force").returncode, 0)

    def test_a_node_finds_its_certificate(self):
        folder, environment = self.config_folder("by-id")
        node = "82301bf1-e1ef-4e89-8d8f-0848291587ac"
        result = run("cert", "node", self.lab, node, **environment)
        self.assertEqual(result.returncode, 0, result.stderr)
        path = os.path.join(folder, "certificates", "{" + node + "}.p12")
        self.assertEqual(result.stdout.strip(), path)
        self.assertEqual(stat.S_IMODE(os.stat(path).st_mode), 0o600)
        self.assertEqual(run("cert", "node", self.lab, node, **environment).returncode, 1)

    def test_a_node_name_gets_an_id_that_stays(self):
        folder, environment = self.config_folder("by-name")
        first = run("cert", "node", self.lab, "my.robot", **environment)
        self.assertEqual(first.returncode, 0, first.stderr)
        with open(os.path.join(folder, "nodeids", "my.robot")) as file:
            node = file.read()
        self.assertIn(node + ".p12", first.stdout)
        again = run("cert", "node", self.lab, "my.robot", "--force", **environment)
        self.assertEqual(again.stdout, first.stdout)

    def test_a_certificate_is_good_for_as_long_as_was_said_and_goes_where_it_shall(self):
        days = {}
        for arguments in [(), ("--days", "7")]:
            self.assertEqual(run("cert", "web", self.lab, "days.example", "--force", *arguments).returncode, 0)
            end = ssl._ssl._test_decode_cert(self.path("days.example.pem"))["notAfter"]
            days[arguments] = round((ssl.cert_time_to_seconds(end) - time.time()) / 86400)
        self.assertEqual(days, {(): 800, ("--days", "7"): 7})
        folder, environment = self.config_folder("not-here")
        node, out = "82301bf1-e1ef-4e89-8d8f-0848291587ad", os.path.join(self.folder, "out")
        result = run("cert", "node", self.lab, node, "--output", out, **environment)
        self.assertEqual(result.stdout.strip(), os.path.join(out, "{" + node + "}.p12"), result.stderr)
        self.assertTrue(os.path.isfile(result.stdout.strip()))
        self.assertFalse(os.path.exists(folder))

    def test_mistakes(self):
        for code, arguments in [(2, ()), (2, ("ca",)), (2, ("cat", "x")), (2, ("web", self.lab)), (2, ("node", self.lab)),
                                (2, ("ca", "x", "--days", "0")), (2, ("web", self.lab, "x", "--output", "x")),
                                (1, ("web", self.lab, "a b")),
                                (1, ("node", "/nowhere", "my.robot")), (1, ("node", self.lab, "1robot"))]:
            with self.subTest(arguments):
                result = run("cert", *arguments)
                self.assertEqual(result.returncode, code, result.stderr)
                self.assertTrue(result.stderr)


class Serving(Lab):
    def start(self, names=("localhost", "other.example"), **tls):
        for name in names:  # of its own, so that a test may replace them
            for ending in (".pem", ".key"):
                shutil.copy(self.path(name + ending), os.path.join(self.folder, self.id() + name + ending))
        certificates = [{"cert": self.id() + name + ".pem", "key": self.id() + name + ".key"} for name in names]
        config = {"listen": ["127.0.0.1:0"], "devices": [{"name": "gone", "url": "rr+tcp://127.0.0.1:1/?service=x"}],
                  "log": {"format": "json"}, "tls": {"certificates": certificates, **tls}}
        path = os.path.join(self.folder, self.id() + ".json")
        with open(path, "w") as file:
            json.dump(config, file)
        self.process = subprocess.Popen([RRGATE, "serve", "--config", path], stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.process.stderr.close)
        self.addCleanup(self.process.wait)
        self.addCleanup(self.process.kill)
        self.port = int(re.search(r":(\d+)$", self.wait_for_event("listening")["address"]).group(1))

    def wait_for_event(self, name):
        for line in self.process.stderr:
            if json.loads(line)["event"] == name:
                return json.loads(line)
        self.fail(f"it ended before it said {name!r}")

    def connect(self, name="localhost", alpn=None, **versions):
        context = ssl.create_default_context(cafile=self.path("web-ca.pem"))
        for version, value in versions.items():
            setattr(context, version, value)
        if alpn:
            context.set_alpn_protocols(alpn)
        plain = socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE)
        self.addCleanup(plain.close)
        secure = context.wrap_socket(plain, server_hostname=name)
        self.addCleanup(secure.close)
        return secure

    def get(self, connection, path="/healthz", host="localhost"):
        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        answer = b""
        while b"\r\n\r\n" not in answer:
            answer += connection.recv(4096)
        return answer.decode()

    def serial(self, name="localhost"):
        return self.connect(name).getpeercert()["serialNumber"]

    def replace(self, name, ending, source):
        path = os.path.join(self.folder, self.id() + name + ending)
        shutil.copy(source, path + ".new")
        os.replace(path + ".new", path)

    def renew(self):
        self.assertEqual(run("cert", "web", self.lab, "localhost", "127.0.0.1", "--force").returncode, 0)

    def test_https_and_http_on_one_port(self):
        self.start()
        for version in ("TLSv1.2", "TLSv1.3"):
            number = getattr(ssl.TLSVersion, version.replace(".", "_"))
            connection = self.connect(minimum_version=number, maximum_version=number)
            self.assertEqual(connection.version(), version)
            self.assertTrue(self.get(connection).startswith("HTTP/1.1 200 OK\r\n"))
            self.assertNotIn("Strict-Transport-Security", self.get(connection))
        with socket.create_connection(("127.0.0.1", self.port)) as plain:
            self.assertTrue(self.get(plain).startswith("HTTP/1.1 200 OK\r\n"))

    def test_each_name_has_its_certificate(self):
        self.start()
        self.assertNotEqual(self.serial("localhost"), self.serial("other.example"))
        self.assertEqual(self.serial("127.0.0.1"), self.serial("localhost"))
        with self.assertRaises(ssl.SSLCertVerificationError):
            self.connect("third.example")

    def test_names_of_the_certificates_are_names_of_the_gateway(self):
        self.start()
        connection = self.connect("other.example")
        self.assertTrue(self.get(connection, host=f"other.example:{self.port}").startswith("HTTP/1.1 200 "))
        self.assertTrue(self.get(connection, host=f"third.example:{self.port}").startswith("HTTP/1.1 421 "))

    def test_http_1_1_is_chosen_and_http_2_alone_refused(self):
        self.start()
        self.assertEqual(self.connect(alpn=["h2", "http/1.1"]).selected_alpn_protocol(), "http/1.1")
        with self.assertRaises(ssl.SSLError):
            self.connect(alpn=["h2"])

    def test_weak_ciphers_are_refused(self):
        self.start()
        context = ssl.create_default_context(cafile=self.path("web-ca.pem"))
        context.maximum_version = ssl.TLSVersion.TLSv1_2
        context.set_ciphers("AES128-SHA:AES256-GCM-SHA384:ECDHE-ECDSA-AES128-SHA")
        with socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE) as plain:
            with self.assertRaises(ssl.SSLError):
                context.wrap_socket(plain, server_hostname="localhost")

    def test_browsers_are_told_to_stay_with_https(self):
        self.start(hsts_seconds=3600)
        self.assertIn("\r\nStrict-Transport-Security: max-age=3600\r\n", self.get(self.connect()))
        with socket.create_connection(("127.0.0.1", self.port)) as plain:
            self.assertNotIn("Strict-Transport-Security", self.get(plain))

    def test_secure_websockets(self):
        self.start()
        connection = self.connect()
        key = base64.b64encode(os.urandom(16)).decode()
        connection.sendall((f"GET /devices/gone HTTP/1.1\r\nHost: localhost:{self.port}\r\nConnection: Upgrade\r\n"
                            f"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
                            f"Origin: https://localhost:{self.port}\r\n"
                            "Sec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\n\r\n").encode())
        answer = b""
        while b"offline" not in answer:
            chunk = connection.recv(4096)
            self.assertTrue(chunk, answer)
            answer += chunk
        self.assertTrue(answer.startswith(b"HTTP/1.1 101 Switching Protocols\r\n"), answer)
        self.assertIn(b"\x03\xf5", answer)  # close code 1013: the device is offline

    def test_files_that_cannot_be_used(self):
        self.start()
        config = os.path.join(self.folder, self.id() + ".json")
        for change, text in [({"cert": "gone.pem", "key": "gone.key"}, "gone.pem"),
                             ({"cert": self.path("localhost.pem"), "key": self.path("other.example.key")}, "other.example.key"),
                             ({"cert": self.path("localhost.key"), "key": self.path("localhost.key")}, "localhost.key")]:
            with open(config, "w") as file:
                json.dump({"listen": ["127.0.0.1:0"], "devices": [], "tls": {"certificates": [change]}}, file)
            result = run("serve", "--config", config)
            self.assertEqual(result.returncode, 1)
            self.assertIn(text, result.stderr)

    def test_renewed_files_are_used_and_open_connections_go_on(self):
        self.start()
        before, old = self.connect(), self.serial()
        self.renew()
        for ending in (".pem", ".key"):
            self.replace("localhost", ending, self.path("localhost" + ending))
        deadline = time.monotonic() + PATIENCE
        while self.serial() == old:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.1)
        self.assertTrue(self.get(before).startswith("HTTP/1.1 200 OK\r\n"))

    def test_a_signal_reads_them_anew_and_a_bad_file_changes_nothing(self):
        self.start()
        before, old = self.connect(), self.serial()
        self.renew()
        self.replace("localhost", ".pem", self.path("localhost.pem"))
        self.process.send_signal(signal.SIGHUP)
        problem = self.wait_for_event("TLS files can't be used; those from before stay in use")
        self.assertIn("localhost.key", problem["error"])
        self.assertEqual(self.serial(), old)
        self.replace("localhost", ".key", self.path("localhost.key"))
        self.process.send_signal(signal.SIGHUP)
        self.wait_for_event("TLS files read anew")
        self.assertNotEqual(self.serial(), old)
        self.assertTrue(self.get(before).startswith("HTTP/1.1 200 OK\r\n"))

    def test_without_certificates_tls_is_not_served(self):
        self.start(names=())
        with self.assertRaises((ssl.SSLError, ConnectionError)):
            self.connect()


if __name__ == "__main__":
    unittest.main()
