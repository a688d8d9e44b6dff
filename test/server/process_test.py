"""rrgate as a process: exit codes, messages, signals. Usage: process_test.py PATH_TO_RRGATE"""
import base64
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.request

RRGATE = sys.argv.pop()


def run(*arguments):
    return subprocess.run([RRGATE, *arguments], capture_output=True, text=True, timeout=30)


def wait_for_port(port):
    until = time.monotonic() + 10
    while time.monotonic() < until:
        try:
            return socket.create_connection(("127.0.0.1", port)).close()
        except ConnectionRefusedError:
            time.sleep(0.02)
    raise AssertionError(f"nobody listens at {port}")


class Files(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def file(self, text):
        path = os.path.join(self.folder.name, "gateway.json")
        with open(path, "w") as out:
            out.write(text if isinstance(text, str) else json.dumps(text))
        return path


class CommandLine(Files):
    def test_help_and_version(self):
        self.assertEqual(run("--version").returncode, 0)
        self.assertRegex(run("--version").stdout, r"^rrgate \d+\.\d+\.\d+\n$")
        help_text = run("--help")
        self.assertEqual(help_text.returncode, 0)
        self.assertRegex(help_text.stdout, r"serve +Run the gateway")
        self.assertIn("--config FILE", run("serve", "--help").stdout)

    def test_mistakes_end_with_2(self):
        for arguments in [(), ("swerve",), ("serve",), ("serve", "--confg", "x"), ("serve", "--config"), ("demo", "--port", "x")]:
            with self.subTest(arguments):
                result = run(*arguments)
                self.assertEqual(result.returncode, 2)
                self.assertTrue(result.stderr)

    def test_a_bad_configuration_is_listed_and_ends_with_2(self):
        path = self.file({"listen": ["8080"], "devices": [{"name": "a", "url": "rr+tpc://h/?service=s"}], "colour": 1})
        for arguments in [("serve", "--config", path), ("check-config", path)]:
            result = run(*arguments)
            self.assertEqual(result.returncode, 2)
            lines = result.stderr.splitlines()
            self.assertEqual(len(lines), 3)
            self.assertTrue(all(line.startswith("gateway.json: /") for line in lines), lines)
            self.assertIn("/devices/0/url: ", result.stderr)
            self.assertIn("known: rr+tcp", result.stderr)

    def test_a_good_configuration(self):
        result = run("check-config", self.file({"listen": ["127.0.0.1:1"], "devices": []}))
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_a_configuration_is_judged_as_json(self):
        good, bad = {"listen": ["127.0.0.1:1"], "devices": []}, {"listen": ["8080"], "devices": []}
        for config, code in ((good, 0), (bad, 2)):
            path = self.file(config)
            result = run("check-config", path, "--json")
            told = json.loads(result.stdout)
            self.assertEqual((result.returncode, result.stderr, result.stdout.count("\n")), (code, "", 1))
            self.assertEqual((told["file"], told["good"], told["warnings"]), (path, code == 0, []))
            self.assertEqual([error["path"] for error in told["errors"]], ["/listen/0"] if code else [])
        self.assertTrue(all(error["text"] for error in told["errors"]))

    def test_what_the_gateway_would_not_start_with_is_no_good_configuration(self):
        other = os.path.join(self.folder.name, "other.pem")
        with open(other, "w") as out:
            out.write("no certificate\n")
        secure = {"name": "arm", "url": "rrs+tcp://127.0.0.1:1/?service=arm"}
        plain = {"name": "lamp", "url": "rr+tcp://127.0.0.1:1/?service=lamp"}
        for ca in (other, "nowhere.pem"):
            for path, config in {
                "/devices/1/tls/ca": {"devices": [plain, {**secure, "tls": {"ca": [ca]}}]},
                "/discover/tls/ca": {"devices": [], "discover": {"tls": {"ca": [ca]}}},
                "/access": {"devices": [], "access": {"jwt": {
                    "discover": True, "issuer": "https://127.0.0.1:1", "audience": "lab", "ca": [ca]}}},
            }.items():
                with self.subTest(path, ca=ca):
                    file = self.file({"listen": ["127.0.0.1:0"], **config})
                    result = run("serve", file)
                    self.assertEqual(result.returncode, 1, result.stderr)
                    self.assertIn(os.path.basename(ca), result.stderr)
                    result = run("check-config", file)
                    self.assertEqual((result.returncode, result.stdout), (2, ""))
                    self.assertIn(f"gateway.json: {path}: ", result.stderr)
                    self.assertIn(os.path.basename(ca), result.stderr)

    def test_health_is_told_as_json(self):
        with socket.socket() as nobody:
            nobody.bind(("127.0.0.1", 0))
            address = f"127.0.0.1:{nobody.getsockname()[1]}"
            result = run("health", address, "--json")
        self.assertEqual((result.returncode, result.stderr), (1, ""))
        self.assertEqual(json.loads(result.stdout), {"address": address, "good": False, "answer": ""})

    def test_findings_of_definitions_are_json(self):
        path = os.path.join(self.folder.name, "lamp.robdef")
        for body, code in [("object Lamp\nend\n", 0), ("object\nend\n", 1)]:
            with open(path, "w") as out:
                out.write("service test.lamp\nstdver 0.10\n" + body)
            result = run("check", path, "--json")
            self.assertEqual((result.returncode, result.stderr), (code, ""))
            told = [json.loads(line) for line in result.stdout.splitlines()]
            self.assertEqual([(each["file"], each["line"], each["severity"]) for each in told][:1],
                             [(path, 3, "error")] if code else [])
            self.assertTrue(all(each["code"] and each["message"] for each in told))

    def test_demos_are_listed_as_json(self):
        told = [json.loads(line) for line in run("demo", "--list", "--json").stdout.splitlines()]
        text = run("demo", "--list").stdout.splitlines()
        self.assertEqual([f"{each['name']:<17}{each['summary']}" for each in told], text)

    def test_definitions_are_checked(self):
        path = os.path.join(self.folder.name, "lamp.robdef")
        for body, code in [("object Lamp\nend\n", 0), ("object\nend\n", 1)]:
            with open(path, "w") as out:
                out.write("service test.lamp\nstdver 0.10\n" + body)
            result = run("check", path)
            self.assertEqual(result.returncode, code)
            self.assertEqual(result.stderr.startswith(path + ":3:"), code == 1, result.stderr)
        for arguments in [("check",), ("fmt", "--in", path), ("generate", "ts"), ("generate", "cobol", path)]:
            self.assertEqual(run(*arguments).returncode, 2)

    def test_code_of_definitions_that_import_others(self):
        """Those are looked for in the folders that are named, one after the other."""
        texts = {"a/test.lamp.robdef": "service test.lamp\nimport test.colour\nimport test.more\nobject Lamp\n"
                                       "property test.colour.Colour colour\nproperty test.more.More more\nend\n",
                 "b/test.colour.robdef": "service test.colour\nstruct Colour\nfield double red\nend\n",
                 "c/test.more.robdef": "service test.more\nstruct More\nfield double much\nend\n"}
        for name, text in texts.items():
            path = os.path.join(self.folder.name, name)
            os.makedirs(os.path.dirname(path))
            with open(path, "w") as out:
                out.write(text)
        lamp, out = (os.path.join(self.folder.name, name) for name in ("a/test.lamp.robdef", "out"))
        folders = [word for name in "bc" for word in ("-I", os.path.join(self.folder.name, name))]
        result = run("generate", "cpp", *folders, "-o", out, lamp)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        with open(os.path.join(out, sorted(os.listdir(out))[1])) as header:
            self.assertIn("Colour", header.read())
        result = run("generate", "cpp", *folders[:2], "-o", out, lamp)
        self.assertEqual(result.returncode, 1)
        self.assertIn("test.more", result.stderr)

    def test_an_address_in_use_ends_with_1(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            result = run("serve", "--config", self.file({"listen": [f"127.0.0.1:{port}"], "devices": []}))
        self.assertEqual(result.returncode, 1)
        self.assertIn(f"127.0.0.1:{port}", result.stderr)


class Demo(Files):
    def start(self, *options):
        """Returns the URL of its pages; what it said before is in self.said."""
        self.log = self.enterContext(tempfile.TemporaryFile("w+"))
        self.process = process = subprocess.Popen([RRGATE, "demo", "--port", "0", *options], stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        self.said = []
        for line in process.stdout:  # the devices say theirs first
            if line.startswith("rrgate demo: http://"):
                return line.split()[-1]
            self.said.append(line.rstrip("\n"))
        self.fail("no address")

    def test_its_devices_are_there_when_it_starts(self):
        self.start()
        self.log.seek(0)
        self.assertEqual(self.log.read(), "")  # no device was offline

    def test_it_ends_well(self):
        self.start("create-minimal")
        self.process.terminate()
        self.assertEqual(self.process.wait(30), 0)

    def test_code_of_a_service_that_runs(self):
        pages = self.start()
        url = pages.replace("http://", "rr+ws://") + "devices/create?service=Create"
        for language, options in [("cpp", ["-o", self.folder.name]), ("ts", ["-o", os.path.join(self.folder.name, "types.ts")])]:
            result = run("generate", language, *options, url)
            self.assertEqual((result.returncode, result.stderr), (0, ""))
        made = os.listdir(self.folder.name)
        for ending in (".hpp", ".cpp", ".ts"):
            texts = [pathlib.Path(self.folder.name, name).read_text() for name in made if name.endswith(ending)]
            self.assertTrue(any("Drive" in text for text in texts), made)
        result = run("generate", "cpp", "-o", self.folder.name, url.replace("service=Create", "service=Nobody"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("Nobody", result.stderr)

    def test_the_robot_and_the_cameras_are_shared(self):
        url = self.start()
        with urllib.request.urlopen(url + "api/v1/devices", timeout=10) as answer:
            devices = json.load(answer)["devices"]
        self.assertEqual([(each["name"], each["mode"], each["state"]) for each in devices],
                         [("create", "shared", "online"), ("webcams", "shared", "online")])


    def test_what_can_be_simulated_is_listed(self):
        listed = run("demo", "--list")
        self.assertEqual((listed.returncode, listed.stderr), (0, ""))
        self.assertEqual([line.split()[0] for line in listed.stdout.splitlines()],
                         ["create", "create-minimal", "robots", "fleet", "webcams", "conference-room", "microassembly", "baxter"])
        with urllib.request.urlopen(self.start("webcams", "--device", "none") + "api/v1/devices", timeout=10) as answer:
            self.assertEqual([each["name"] for each in json.load(answer)["devices"]], ["webcams"])
        unknown = run("demo", "fox")
        self.assertEqual((unknown.returncode, unknown.stdout), (2, ""))
        self.assertIn("fox", unknown.stderr)
        self.assertIn("webcams", unknown.stderr)

    def test_webcams_show_pictures_of_files(self):
        picture = os.path.join(self.folder.name, "picture.jpg")
        webcams = self.start("webcams", "--device=none") + "devices/webcams?service=Webcam"
        self.assertEqual(run("call", webcams, "Webcams/0/CaptureFrame", "-o", picture).returncode, 0)
        webcams = self.start("webcams", "--pictures", self.folder.name) + "devices/webcams?service=Webcam"
        shown = json.loads(run("call", webcams, "Webcams/0/CaptureFrame", "--json").stdout)
        self.assertEqual((shown["width"], shown["height"], shown["step"]), (320, 240, 960))
        self.assertNotEqual(run("get", webcams, "Webcams/1/Name").returncode, 0)
        self.assertIn("webcam 0: " + os.path.basename(self.folder.name), self.said)

    def test_a_camera_that_is_not_there_is_told_to_who_asks_for_its_frames(self):
        webcams = self.start("webcams", "--device", "/dev/no-camera") + "devices/webcams?service=Webcam"
        refused = run("call", webcams, "Webcams/0/CaptureFrame")
        self.assertEqual(refused.returncode, 5)
        self.assertIn("/dev/no-camera can't be opened: No such file or directory", refused.stderr)

    def test_cameras_are_chosen_for_webcams_alone(self):
        for arguments in (["create", "--device", "none"], ["microassembly", "--pictures", "x"], ["--device", "/dev/video0"],
                          ["webcams", "--device", "none", "--pictures", "x"], ["webcams", "--device"]):
            with self.subTest(arguments):
                refused = run("demo", *arguments)
                self.assertEqual((refused.returncode, refused.stdout), (2, ""))
                self.assertIn("--device", refused.stderr)

    def test_other_machines_come_with_a_password(self):
        url = self.start("--lan")
        password = next(line for line in self.said if line.startswith("rrgate demo: user demo, ")).split()[-1]

        def ask(given):
            login = base64.b64encode(f"demo:{given}".encode()).decode()
            headers = {"Authorization": f"Basic {login}"} if given else {}
            with urllib.request.urlopen(urllib.request.Request(url + "api/v1/devices", headers=headers), timeout=10) as answer:
                return [each["name"] for each in json.load(answer)["devices"]]

        self.assertEqual(ask(password), ["create", "webcams"])
        for wrong in ("", password[:-1]):
            with self.subTest(wrong), self.assertRaises(urllib.error.HTTPError) as refused:
                ask(wrong)
            self.assertEqual(refused.exception.code, 401)

    def test_a_password_needs_a_temporary_folder(self):
        """Nothing is put into the folder that it is started in instead."""
        for place in (os.path.join(self.folder.name, "nothing"), "/proc"):
            with self.subTest(place):
                refused = subprocess.run([RRGATE, "demo", "--lan", "--port", "0"], capture_output=True, text=True, timeout=30,
                                         cwd=self.folder.name, env={**os.environ, "TMPDIR": place})
                self.assertEqual((refused.returncode, refused.stdout), (1, ""))
                self.assertIn(f"rrgate demo: no temporary folder can be made in {place}: ", refused.stderr)
                self.assertEqual(os.listdir(self.folder.name), [])


class Serving(Files):
    def start(self, **more):
        config = {"listen": ["127.0.0.1:0"], "devices": [], "log": {"format": "json"}, **more}
        process = subprocess.Popen([RRGATE, "serve", "--config", self.file(config)], stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        for line in process.stderr:
            event = json.loads(line)
            if event["event"] == "listening":
                return process, int(re.search(r":(\d+)$", event["address"]).group(1))
        self.fail("it ended before it listened")

    def test_all_addresses_are_those_of_ipv4_too(self):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        both = [f"[::]:{port}", f"0.0.0.0:{port}"]
        process, _ = self.start(listen=both[:1], insecure=True)
        for listen in ([], both, both[:1], both[::-1]):
            if listen:
                self.file({"listen": listen, "devices": [], "log": {"format": "json"}, "insecure": True})
                process.send_signal(signal.SIGHUP)
                for line in process.stderr:
                    event = json.loads(line)
                    self.assertNotEqual(event["level"], "error", event)
                    if event["event"].startswith("configuration"):
                        break
            for host in ("127.0.0.1", "::1"):
                with self.subTest(listen=listen, host=host), socket.create_connection((host, port), timeout=10) as client:
                    client.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    self.assertTrue(client.recv(4096).startswith(b"HTTP/1.1 200 OK\r\n"))

    def test_a_signal_ends_an_idle_gateway(self):
        process, _ = self.start()
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(timeout=10), 0)

    def test_signals_end_it_with_0(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            process, port = self.start()
            with socket.create_connection(("127.0.0.1", port)) as client:
                client.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
                self.assertTrue(client.recv(4096).startswith(b"HTTP/1.1 200 OK\r\n"))
                process.send_signal(number)
                self.assertEqual(process.wait(timeout=10), 0)
                self.assertEqual(client.recv(4096), b"")
            events = [json.loads(line)["event"] for line in process.stderr]
            self.assertEqual(events[-1], "stopped")

    def fill_log(self, port):
        """Has the gateway write far more than a pipe holds and the gateway keeps: each character of an origin takes six."""
        for number in range(60 * 20):  # few of one address are written
            with socket.create_connection(("127.0.0.1", port), 10, source_address=(f"127.0.1.{1 + number % 60}", 0)) as client:
                client.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nOrigin: http://" + b"\xe9" * 400 + b"\r\n"
                               b"Connection: close\r\n\r\n")
                self.assertTrue(client.recv(64).startswith(b"HTTP/1.1 403 "))

    def test_a_log_that_nobody_reads_stops_nothing(self):
        process, port = self.start()
        self.fill_log(port)

        def ask(path):
            with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=10) as answer:
                return answer.read().decode()

        self.assertIn("ok", ask("/healthz"))
        lost = int(re.search(r"^rrgate_log_lost_total (\d+)$", ask("/metrics"), re.M)[1])
        self.assertGreater(lost, 0)
        told = None
        while not told:
            event = json.loads(process.stderr.readline())
            if event["event"].startswith("lines of the log were lost"):
                told = event["lines"]
        self.assertEqual(told, lost)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(json.loads(process.stderr.readlines()[-1])["event"], "stopped")
        self.assertEqual(process.wait(timeout=10), 0)

    def test_a_log_that_nobody_reads_keeps_no_gateway_from_its_end(self):
        process, port = self.start()
        self.fill_log(port)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(timeout=10), 0)

    def test_refusals_of_one_network_fill_no_log(self):
        process, port = self.start()
        for _ in range(60):
            with socket.create_connection(("127.0.0.1", port), 10) as client:
                client.sendall(b"nonsense\r\n\r\n")
                client.recv(64)
        process.send_signal(signal.SIGTERM)
        events = [json.loads(line)["event"] for line in process.stderr]
        self.assertEqual(events.count("connection closed: neither Robot Raconteur nor HTTP"), 20)

    def test_a_second_signal_waits_for_nobody(self):
        """A session may end by itself within the drain time, unless whoever runs the gateway has enough."""
        with socket.create_server(("127.0.0.1", 0)) as device:
            url = f"rr+tcp://127.0.0.1:{device.getsockname()[1]}/?service=s"
            process, port = self.start(devices=[{"name": "d", "url": url}], timeouts={"drain_ms": 60000})
            with socket.create_connection(("127.0.0.1", port)) as client:
                client.sendall(b"GET /devices/d?service=s HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
                               b"Connection: Upgrade\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
                               b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\n\r\n")
                self.assertTrue(client.recv(4096).startswith(b"HTTP/1.1 101 "))
                process.send_signal(signal.SIGTERM)
                with self.assertRaises(subprocess.TimeoutExpired):
                    process.wait(timeout=0.5)
                process.send_signal(signal.SIGTERM)
                self.assertEqual(process.wait(timeout=10), 0)

    def test_the_log_says_what_its_level_is_for(self):
        for level, said in [("info", {"listening", "signal", "stopped"}), ("error", set())]:
            with socket.create_server(("127.0.0.1", 0)) as taken:  # an address to be known beforehand
                port = taken.getsockname()[1]
            path = self.file({"listen": [f"127.0.0.1:{port}"], "devices": [], "log": {"format": "json", "level": level}})
            with subprocess.Popen([RRGATE, "serve", "--config", path], stderr=subprocess.PIPE, text=True) as process:
                self.addCleanup(process.kill)
                wait_for_port(port)
                process.send_signal(signal.SIGTERM)
                events = {json.loads(line)["event"] for line in process.stderr}
            self.assertEqual(events & {"listening", "signal", "stopped"}, said)

    def test_web_root_counts_from_the_configuration_file(self):
        with open(os.path.join(self.folder.name, "index.html"), "w") as page:
            page.write("<p>here")
        _, port = self.start(web_root=".")
        with socket.create_connection(("127.0.0.1", port)) as client:
            client.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            answer = b"".join(iter(lambda: client.recv(4096), b""))
        self.assertTrue(answer.endswith(b"<p>here"), answer)


if __name__ == "__main__":
    unittest.main()
