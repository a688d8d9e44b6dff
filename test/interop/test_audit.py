"""The audit log: what is done on each face makes exactly one record; records are chained, and nothing goes unrecorded where that
is wanted."""
import contextlib
import gzip
import json
import re
import resource
import subprocess

import pytest
import RobotRaconteur as RR
import websockets.sync.client

from gateways import RRGATE, Gateway, rrgate
from http_api import BASE, JSON_PROTOCOL, Stream, ask
from json_sockets import Socket
from users import PASSWORDS, RULES, basic, bearer, make_users

CLIENT_LOCK = RR.RobotRaconteurObjectLockFlags_CLIENT_LOCK
OF_ITSELF = ("started", "stopped", "resumed")
TRACE = "0af7651916cd43dd8448eb211c80319c"
TRACED = {"traceparent": f"00-{TRACE}-b7ad6b7169203331-01"}
MARK = "/api/v1/devices/interop/interop/p_int32"


def records(path):
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


class Site:
    """A gateway to one device, shared and relayed, whose audit log is read along."""

    def __init__(self, folder, device, audit={}, leases={}, **more):
        make_users(folder)
        self.folder, self.file, self.read = folder, folder / "audit", 0
        self.token = rrgate("token", folder / "tokens", "ci", "--roles", "admin")
        devices = [{"name": "interop", "url": device, "mode": "shared", "leases": leases}, {"name": "relayed", "url": device}]
        self.gateway = Gateway(folder, {"devices": devices, "audit": {"file": "audit", **audit}, "node": {"name": "lab.gateway"},
                                        "access": {"users_file": "users", "tokens_file": "tokens", "rules": RULES}}, **more)
        self.port = self.gateway.port
        self.gateway.wait_for("device online", device="interop")
        self.gateway.wait_for("device online", device="relayed")

    def url(self, scheme):
        where = {"rr+tcp": "?nodename=interop&", "rr+ws": "devices/interop?"}[scheme]
        return f"{scheme}://127.0.0.1:{self.port}/{where}service=interop"

    def of(self, action):
        """What an action is recorded with: all that comes before the record of a request behind it."""
        action()
        assert ask(self.port, "PUT", MARK, 1, bearer(self.token)).status == 204
        found = []

        def is_there():
            found[:] = [each for each in records(self.file)[self.read:] if each["event"] not in OF_ITSELF]
            return found and found[-1].get("member") == "p_int32"

        self.gateway.process.wait_until(is_there)
        self.read = len(records(self.file))
        return found[:-1]

    def one(self, action, **expected):
        made = self.of(action)
        assert len(made) == 1, made
        assert {key: made[0].get(key) for key in expected} == expected, made[0]
        assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", made[0]["time"])
        return made[0]

    def stop(self):
        assert self.gateway.process.stop() == 0, self.gateway.process.description()


@pytest.fixture(scope="module")
def site(device, tmp_path_factory):
    site = Site(tmp_path_factory.mktemp("audit"), device)
    yield site
    site.stop()
    assert records(site.file)[-1]["event"] == "stopped"
    verify(site.file)


def verify(*files):
    done = subprocess.run([RRGATE, "audit", "--verify", *files], capture_output=True, text=True, timeout=30)
    assert (done.returncode, done.stderr) == (0, ""), done
    assert "as they were written" in done.stdout
    return done.stdout


def fails(error, action, *arguments):
    def attempt():
        with pytest.raises(error):
            action(*arguments)
    return attempt


ROOT = {"user": "root", "roles": ["admin"], "proof": "password"}
THERE = {"device": "interop", "service": "interop", "path": "interop"}
WRITE = {"event": "write", "verb": "write", "outcome": "ok", "member": "p_double", **THERE}
CALL = {"event": "call", "verb": "call", "outcome": "ok", "member": "add", **THERE}
FAILED = {"event": "call", "verb": "call", "outcome": "error", "member": "fail", "detail": "as wanted", **THERE}
REFUSED = {"event": "refused", "verb": "write", "outcome": "refused", "member": "p_double", "user": "vera", "roles": ["viewer"], **THERE}
# As the service has no users, it refuses locks.
LOCK = {"event": "lock", "verb": "lock", "outcome": "error", "detail": "User authentication not activated for this service", **THERE}
UNLOCK = {"event": "unlock", "verb": "lock", "outcome": "ok", **THERE}
SUBSCRIBED = {"event": "subscribe", "verb": "subscribe", "outcome": "ok", "member": "both", **THERE}


@pytest.mark.parametrize("scheme, face", [("rr+tcp", "native"), ("rr+ws", "websocket")])
def test_sessions_of_robot_raconteur(site, node, scheme, face):
    roots = {}

    def connect(user, password=None):
        credentials = {"password": RR.VarValue(PASSWORDS[user] if password is None else password, "string")}
        roots[user] = node.ConnectService(site.url(scheme), user, credentials)

    login = {"event": "login", "outcome": "ok", "proof": "password", "face": face}
    made = site.one(lambda: connect("root"), **login, user="root")
    assert made["client"].startswith("127.0.0.1:")
    site.one(lambda: connect("vera"), **login, user="vera")
    site.one(fails(RR.AuthenticationException, connect, "alice", "wrong"), event="login_failed", outcome="refused", user="alice", face=face)
    root, vera = roots["root"], roots["vera"]
    assert site.of(lambda: root.p_double) == []
    site.one(lambda: setattr(root, "p_double", 1.5), **WRITE, **ROOT, face=face)
    site.one(lambda: root.add(1.0, 2.0), **CALL, **ROOT, face=face)
    site.one(fails(RR.OperationFailedException, root.fail, "operation_failed", "as wanted"), **FAILED, **ROOT, face=face)
    site.one(fails(RR.PermissionDeniedException, setattr, vera, "p_double", 1.5), **REFUSED, face=face)
    site.one(fails(RR.InvalidOperationException, node.RequestObjectLock, root, CLIENT_LOCK), **LOCK, **ROOT, face=face)
    site.one(lambda: node.ReleaseObjectLock(root), **UNLOCK, **ROOT, face=face)
    site.one(lambda: root.both.PokeOutValue(1.0), **{**WRITE, "member": "both"}, **ROOT, face=face)
    wires = []
    site.one(lambda: wires.append(root.both.Connect()), **SUBSCRIBED, **ROOT, face=face)

    def send():
        for number in range(5):
            wires[0].OutValue = 10.0 + number
            site.gateway.process.wait_until(lambda: root.both.PeekOutValue()[0] == 10.0 + number)

    site.one(send, **{**WRITE, "member": "both"}, **ROOT, face=face)
    assert site.of(send) == site.of(wires[0].Close) == []
    generators = []
    site.one(lambda: generators.append(root.count_up(1.0, 3)), **{**CALL, "member": "count_up"}, **ROOT, face=face)
    assert site.of(lambda: [generators[0].Next(), generators[0].Close()]) == []
    for each in roots.values():
        node.DisconnectService(each)


def test_the_service_of_the_gateway_itself(site, node):
    credentials = {"password": RR.VarValue(PASSWORDS["root"], "string")}
    root = node.ConnectService(f"rr+tcp://127.0.0.1:{site.port}/?nodename=lab.gateway&service=gateway", "root", credentials)
    site.of(lambda: None)
    site.one(lambda: root.find_device("interop"), **{**CALL, "member": "find_device", "device": "gateway", "service": "gateway",
                                                     "path": "gateway"}, **ROOT, face="native")
    node.DisconnectService(root)


def test_requests_of_http(site):
    def do(method, path, body=None, user="root", status=(200, 204), headers={}):
        answer = ask(site.port, method, BASE + path, body, {**basic(user), **headers})
        assert answer.status in status, answer.body

    site.of(lambda: [do("GET", "/p_double"), do("GET", "/p_double", user="vera")])  # the logins
    face = {"face": "rest", "proof": "password"}
    assert site.of(lambda: do("GET", "/p_double")) == []
    made = site.one(lambda: do("PUT", "/p_double", 1.5, headers=TRACED), **{**WRITE, **ROOT, **face}, trace=TRACE)
    assert "prev" not in made and made["client"].startswith("127.0.0.1:")
    site.one(lambda: do("POST", "/add", {"left": 1, "right": 2}), **{**CALL, **ROOT, **face})
    site.one(lambda: do("POST", "/fail", {"kind": "operation_failed", "text": "as wanted"}, status=(422,)), **{**FAILED, **ROOT, **face})
    site.one(lambda: do("PUT", "/p_double", "no number", status=(400,)), **{**WRITE, **ROOT, **face, "outcome": "error"})
    site.one(lambda: do("PUT", "/p_double", 1.5, "vera", (403,)), **REFUSED, **face)
    site.one(lambda: do("POST", "/count_up", {"first": 1, "count": 3}), **{**CALL, **ROOT, **face, "member": "count_up"})
    by_token = {"user": "ci", "proof": "token", "face": "rest"}
    site.one(lambda: ask(site.port, "PUT", BASE + "/p_double", 2.5, bearer(site.token)), **WRITE, **by_token)
    site.one(lambda: ask(site.port, "GET", BASE + "/p_double", headers=basic("alice", "wrong")), event="login_failed", outcome="refused",
             user="alice", face="rest")


def test_streams_of_http(site):
    site.of(lambda: ask(site.port, "GET", BASE + "/p_double", headers=basic("root")))
    with contextlib.closing(Stream(site.port, BASE + "/both", {**basic("root"), **TRACED})):
        made = site.of(lambda: None)
    (opened,) = made
    expected = {**SUBSCRIBED, **ROOT, "face": "stream", "trace": TRACE}
    assert {key: opened.get(key) for key in expected} == expected


def test_json_on_a_websocket(site):
    def open_socket(user):
        return websockets.sync.client.connect(f"ws://127.0.0.1:{site.port}{BASE}", additional_headers={**basic(user), **TRACED},
                                              subprotocols=[JSON_PROTOCOL], proxy=None)

    def do(link, fails=False, **request):
        def act():
            link.send(json.dumps({"id": 1, **request}))
            while "id" not in (answer := json.loads(link.recv(10))):
                pass
            assert ("error" in answer) == fails, answer
        return act

    site.of(lambda: [ask(site.port, "GET", BASE + "/p_double", headers=basic(user)) for user in ("root", "vera")])
    with open_socket("root") as root, open_socket("vera") as vera:
        face = {**ROOT, "face": "json", "trace": TRACE}
        assert site.of(do(root, op="get", path="p_double")) == []
        site.one(do(root, op="set", path="p_double", value=1.5), **WRITE, **face)
        site.one(do(root, op="call", path="add", args={"left": 1, "right": 2}), **CALL, **face)
        site.one(do(root, True, op="call", path="fail", args={"kind": "operation_failed", "text": "as wanted"}), **FAILED, **face)
        site.one(do(vera, True, op="set", path="p_double", value=1.5), **REFUSED, face="json")
        site.one(do(root, True, op="lock", path=""), **LOCK, **face)
        site.one(do(root, op="unlock", path=""), **UNLOCK, **face)
        send = do(root, op="send", path="both", value=3.0)
        site.one(send, **{**WRITE, "member": "both"}, **face)
        assert site.of(send) == []
        site.one(do(root, op="subscribe", path="both"), **SUBSCRIBED, **face)


def test_what_is_relayed(site, node):
    site.of(lambda: ask(site.port, "GET", BASE + "/p_double", headers=basic("root")))
    for user, expected in (("root", {"event": "relay", "outcome": "ok"}), ("vera", {"event": "refused", "outcome": "refused"})):
        def connect():
            with contextlib.suppress(websockets.exceptions.InvalidStatus):
                with websockets.sync.client.connect(f"ws://127.0.0.1:{site.port}/devices/relayed", additional_headers=basic(user),
                                                    subprotocols=["robotraconteur.robotraconteur.com"], proxy=None):
                    pass

        made = [each for each in site.of(connect) if each["event"] != "login"]
        assert [{key: each.get(key) for key in expected} for each in made] == [expected], made
        assert (made[0]["user"], made[0]["device"], made[0]["face"]) == (user, "relayed", "websocket")


def test_what_admins_decide(site):
    requests = "/api/v1/access/requests"

    def post(path, body, headers={}):
        answer = ask(site.port, "POST", requests + path, body, headers)
        assert answer.status in (200, 202), answer.body
        return answer.json

    asked = []
    for name in ("tablet", "phone"):
        site.one(lambda: asked.append(post("", {"name": name})), event="asked", detail=name, proof="none", face="rest")
    made, approved = site.of(lambda: post(f"/{asked[0]['id']}/approve", {"roles": ["viewer"]}, bearer(site.token)))
    assert (made["event"], made["detail"]) == ("token_made", "tablet: roles viewer")
    assert (approved["event"], approved["user"], approved["proof"], approved["face"]) == ("approved", "ci", "token", "rest")
    assert approved["detail"].startswith("tablet of 127.0.0.1:") and "roles viewer" in approved["detail"]
    site.one(lambda: post(f"/{asked[1]['id']}/deny", {}, bearer(site.token)), event="denied", user="ci", outcome="ok", face="rest")

    def revoke():
        count = len(site.gateway.events("users and rights read anew"))
        rrgate("token", site.folder / "tokens", "tablet", "--delete")
        site.gateway.wait_for("users and rights read anew", count + 1)

    site.one(revoke, event="token_revoked", detail="tablet: roles viewer")


def test_the_file_is_filtered(site):
    ask(site.port, "PUT", BASE + "/p_double", 7.5, basic("root"))
    ask(site.port, "PUT", BASE + "/p_double", 7.5, basic("vera"))
    site.of(lambda: None)
    everything = records(site.file)

    def printed(*words):
        return [json.loads(line) for line in rrgate("audit", "--json", site.file, *words).splitlines()]

    assert printed() == everything
    for words, key, value in ((["--user", "ver?"], "user", "vera"), (["--device", "interop"], "device", "interop"),
                              (["--member", "p_dou*"], "member", "p_double"), (["--outcome", "refused"], "outcome", "refused"),
                              (["--face", "rest"], "face", "rest")):
        assert printed(*words) == [each for each in everything if each.get(key) == value] != [], words
    middle = everything[len(everything) // 2]["time"]
    assert printed("--since", middle) == [each for each in everything if each["time"] >= middle]
    assert printed("--since", "1h") == everything and printed("--since", "2100-01-01") == []
    text = rrgate("audit", site.file, "--user", "vera", "--outcome", "refused").splitlines()[-1]
    assert re.search(r"Z  refused  refused  vera  password  rest  127\.0\.0\.1:\d+  interop interop p_double$", text), text
    for words, code in ((["--since", "soon"], 2), (["--outcome", "good"], 2), (["--verify", "--user", "x"], 2)):
        assert subprocess.run([RRGATE, "audit", site.file, *words], capture_output=True).returncode == code
    for words in ([], ["--verify"]):
        missing = subprocess.run([RRGATE, "audit", site.folder / "nothing", *words], capture_output=True, text=True)
        assert missing.returncode == 3 and "No such file" in missing.stderr


def test_what_is_no_record_is_told(device, tmp_path):
    """A compressed file is not read, and that must not look as if nothing had happened."""
    site = Site(tmp_path, device, {"max_bytes": 2000, "keep": 5})
    for number in range(20):
        assert ask(site.port, "PUT", BASE + "/p_double", number, bearer(site.token)).status == 204
    site.stop()
    rotated = tmp_path / "audit.1"
    packed = tmp_path / "audit.2.gz"
    packed.write_bytes(gzip.compress(rotated.read_bytes()))
    lines = rotated.read_text().splitlines()

    def read(*files):
        done = subprocess.run([RRGATE, "audit", "--json", *files], capture_output=True, timeout=30)
        return done.returncode, done.stdout.decode().splitlines(), done.stderr.decode()

    assert read(rotated) == (0, lines, "")
    code, printed, said = read(rotated, packed)
    assert (code, printed) == (3, lines) and re.fullmatch(re.escape(str(packed)) + r": \d+ lines? (is|are) no records?\n", said), said
    # Neither is a record that is being written, nor half of one that a killed gateway left.
    half = tmp_path / "half"
    half.write_text("\n".join(lines) + "\n" + lines[0][:40])
    assert read(half) == (0, lines, "")
    half.write_text(lines[0] + "\n" + lines[1][:40] + "\n" + lines[2] + "\n")
    assert read(half) == (3, [lines[0], lines[2]], f"{half}: 1 line is no record\n")


def test_following_goes_on_behind_a_rotation(device, tmp_path):
    site = Site(tmp_path, device, {"max_bytes": 5000, "keep": 5})
    follower = subprocess.Popen([RRGATE, "audit", "--follow", "--json", "--member", "p_double", site.file], stdout=subprocess.PIPE, text=True)
    try:
        for number in range(30):
            assert ask(site.port, "PUT", BASE + "/p_double", number, bearer(site.token)).status == 204
            assert json.loads(follower.stdout.readline())["event"] == "write"
        assert (tmp_path / "audit.2").exists()
    finally:
        follower.terminate()
        assert follower.wait(10) == 0
        site.stop()
    assert "records, 1 to " in verify(*tmp_path.glob("audit*"))


def test_the_chain_goes_on_behind_a_restart_and_tells_what_was_changed(device, tmp_path):
    site = Site(tmp_path, device)
    for start in range(2):
        for number in range(5):
            assert ask(site.port, "PUT", BASE + "/p_double", number, bearer(site.token)).status == 204
        site.stop()
        if start == 0:
            site.gateway.start()
            site.gateway.wait_for("device online", device="interop")
    lines = site.file.read_text().splitlines()
    assert [json.loads(line)["seq"] for line in lines] == list(range(1, len(lines) + 1))
    assert [each["event"] for each in records(site.file) if each["event"] in OF_ITSELF] == ["started", "stopped"] * 2
    verify(site.file)
    changes = {
        "edited": ([*lines[:3], lines[3].replace('"ci"', '"me"'), *lines[4:]], ":4: found record 4 with hash"),
        "cut out": ([*lines[:3], *lines[4:]], ":4: found record 5, expected record 4"),
        "reordered": ([*lines[:3], lines[4], lines[3], *lines[5:]], ":4: found record 5, expected record 4"),
        "cut off": (lines[:-3], f": found an end at record {len(lines) - 3}, expected record {len(lines)} with hash"),
    }
    for what, (changed, message) in changes.items():
        site.file.write_text("\n".join(changed) + "\n")
        done = subprocess.run([RRGATE, "audit", "--verify", site.file], capture_output=True, text=True)
        assert done.returncode == 1 and f"{site.file}{message}" in done.stderr, (what, done)
    # What was cut off stays missed.
    site.gateway.start()
    found = site.gateway.wait_for("audit log")["found"]
    assert f"ends with record {len(lines) - 3}, but {len(lines)} were written" in found
    site.stop()
    done = subprocess.run([RRGATE, "audit", "--verify", site.file], capture_output=True, text=True)
    assert done.returncode == 1 and f"found record {len(lines) + 1}, expected record {len(lines) - 2}" in done.stderr, done


def limit_files(site, size):
    """Files don't grow above it: as a disk that is full."""
    process = site.gateway.process.process.pid
    resource.prlimit(process, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


@pytest.mark.parametrize("is_closed", [False, True])
def test_a_disk_that_is_full_and_has_room_again(device, node, tmp_path, is_closed):
    never = [{"member": f"interop.{name}", "lease": "never"} for name in ("p_int8", "target")]
    site = Site(tmp_path, device, {"fail_closed": is_closed}, {"members": never},
                command=["env", "--ignore-signal=XFSZ"])
    login = ("root", {"password": RR.VarValue(PASSWORDS["root"], "string")}, None, None)
    arm = node.ConnectService(site.url("rr+tcp"), *login)
    leases = node.ConnectService(f"rr+tcp://127.0.0.1:{site.port}/?nodename=lab.gateway&service=gateway", *login)
    try:
        session = node.GetServiceAttributes(arm)["rrgate.session"].data
        leases.acquire_lease(session, "interop.parts[8]", 20_000)
        taken = ask(site.port, "POST", BASE + "/parts/7?lease=acquire&deadman=20000", headers=bearer(site.token)).json["lease"]
        mine = {"Rrgate-Lease": taken, **bearer(site.token)}

        def write():
            return ask(site.port, "PUT", BASE + "/p_double", 1.5, bearer(site.token))

        # Larger than the log, which the limit holds for as well.
        while site.file.stat().st_size < 20_000 + site.gateway.log.stat().st_size:
            assert write().status == 204
        site.of(lambda: None)
        limit_files(site, site.file.stat().st_size + 100)
        write()
        failure = site.gateway.wait_for("audit log can't be written")
        assert "File too large" in failure["error"]
        assert site.gateway.process.wait_until(lambda: write().status == (503 if is_closed else 204)) is None
        assert ask(site.port, "GET", BASE + "/p_double", headers=bearer(site.token)).status == 200
        metrics = ask(site.port, "GET", "/metrics", headers=bearer(site.token)).body.decode()
        assert "rrgate_audit_up 0" in metrics and ("rrgate_audit_refused_total 0" in metrics) != is_closed
        if is_closed:
            refused = write()
            assert "the gateway can't write its audit log (File too large), and does nothing that it can't record" in refused.json["detail"]
            stream = ask(site.port, "GET", BASE + "/both", headers={"Accept": "text/event-stream", **bearer(site.token)})
            assert stream.status == 503
            assert re.search(r'rrgate_rejected_total\{reason="audit"\} [1-9]', metrics)
            assert ask(site.port, "POST", BASE + "?lease=acquire", headers=bearer(site.token)).status == 503
            assert ask(site.port, "PUT", BASE + "/p_double?lease=renew", 1.5, bearer(site.token)).status == 503
            with pytest.raises(RR.RobotRaconteurException, match="can't write its audit log"):
                arm.p_double = 2.5
        # What stops something, keeps a lease or gives it back, is done in any case.
        arm.p_int8 = 1
        arm.target.Connect().OutValue = 1.0
        assert ask(site.port, "PUT", BASE + "/p_int8", 2, bearer(site.token)).status == 204
        with Socket(site.port, additional_headers=bearer(site.token)) as page:
            assert page.ask("set", "p_int8", value=3) is None
        leases.renew_lease(session, "interop.parts[8]")
        leases.release_lease(session, "interop.parts[8]")
        assert ask(site.port, "POST", BASE + "/parts/7?lease=renew", headers=mine).status == 204
        assert ask(site.port, "POST", BASE + "/parts/7?lease=release", headers=mine).status == 204
        limit_files(site, resource.RLIM_INFINITY)
        site.gateway.wait_for("audit log can be written again")
        assert write().status == 204
        site.of(lambda: None)
        (resumed,) = (each for each in records(site.file) if each["event"] == "resumed")
        assert resumed["detail"].startswith("File too large for ") and "0 records were lost" in resumed["detail"]
        assert ("0 requests refused" in resumed["detail"]) != is_closed
    finally:
        for service in (arm, leases):
            node.DisconnectService(service)
        site.stop()
    verify(site.file)


def test_nothing_is_done_from_the_start_where_nothing_can_be_recorded(device, tmp_path):
    site = Site(tmp_path, device, {"file": "/dev/full", "fail_closed": True})
    try:
        assert ask(site.port, "PUT", BASE + "/p_double", 1.5, bearer(site.token)).status == 503
        assert ask(site.port, "GET", BASE + "/p_double", headers=bearer(site.token)).status == 200
        assert "No space left on device" in site.gateway.wait_for("audit log can't be written")["error"]
    finally:
        site.stop()
