"""The Debian package of the gateway, in a fresh Debian 12: installed by apt with what it depends on, run by the user, program and arguments of its unit."""
import base64
import contextlib
import gzip
import hashlib
import json
import re
import resource
import shutil
import ssl
import subprocess
import time

import pytest

from clients import JS
from guest import make_initrd, qemu_command
from http_api import ask
from machine import need
from processes import BUILD, ROOT, START_DEADLINE, Background, free_port

PACKAGES = ROOT / "build" / "package"
BASE = ROOT / "build" / "deps" / "package-base.tar"  # a Debian with apt, and archives of what the package depends on: ./dev test made it
GUEST_LIMIT = 300  # seconds; 60 are usual, more where other programs want the processors too
DOCUMENT = ROOT / "docs" / "access.md"


class Root:
    """A Debian in a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.installing = 0.0  # seconds of processor time

    def run(self, *words, given=None, fails=False):
        result = subprocess.run(["chroot", self.folder, *words], capture_output=True, text=True, input=given, timeout=60)
        assert fails or result.returncode == 0, f"{words}\n{result.stdout}{result.stderr}"
        return result

    def path(self, inside):
        return self.folder / inside.lstrip("/")


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    need("debian-root")
    (deb,) = PACKAGES.glob("rrgate_*_amd64.deb")
    folder = tmp_path_factory.mktemp("root")
    folder.chmod(0o755)
    subprocess.run(["tar", "-x", "-C", folder, "--exclude=./dev/*", "-f", BASE], check=True, timeout=120)
    subprocess.run(["mknod", "-m", "666", folder / "dev/null", "c", "1", "3"], check=True)
    subprocess.run(["mknod", "-m", "666", folder / "dev/urandom", "c", "1", "9"], check=True)
    shutil.copy(deb, folder)
    root = Root(folder)
    before = processor_time()
    # As the pages say it; without somebody who answers.
    root.run("sh", "-c", f"cd / && DEBIAN_FRONTEND=noninteractive apt install -y ./{deb.name}")
    root.installing = processor_time() - before
    yield root
    shutil.rmtree(folder, ignore_errors=True)


def processor_time():
    """Seconds, of all processes that were started here and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def unit(root):
    """What the unit says, by key; the last of each."""
    return dict(re.findall(r"^(\w+)=(.*)$", root.path("/lib/systemd/system/rrgate.service").read_text(), re.M))


def started(root, log, config="/etc/rrgate/gateway.json"):
    about = unit(root)
    program, *arguments = about["ExecStart"].split()
    arguments[-1] = config
    words = ["chroot", root.folder, "/usr/bin/setpriv", f"--reuid={about['User']}", f"--regid={about['Group']}", "--init-groups",
             "--no-new-privs", "/usr/bin/env", "ROBOTRACONTEUR_USER_HOME=/var/lib/rrgate", program, *arguments]
    return Background(words, log)


def answer_of(gateway, port, path, **how):
    """The answer, once there is one."""
    deadline = time.monotonic() + START_DEADLINE
    while True:
        try:
            return ask(port, "GET", path, **how)
        except OSError:
            assert gateway.process.poll() is None and time.monotonic() < deadline, "the gateway does not run"
            time.sleep(0.05)


def test_nothing_tells_where_it_was_built():
    debs = sorted(PACKAGES.glob("*_amd64.deb"))
    assert [deb.name.split("_")[0] for deb in debs] == ["rrgate-dev", "rrgate"]
    files = {deb.name: subprocess.run(["dpkg-deb", "--fsys-tarfile", deb], capture_output=True, check=True, timeout=120).stdout
             for deb in debs}
    (client,) = PACKAGES.glob("rrgate-client-*.tgz")
    files[client.name] = gzip.decompress(client.read_bytes())
    for name, content in files.items():
        assert str(ROOT).encode() not in content, name


def header_packages():
    """The Debian packages of the headers that what is shipped was compiled with."""
    files, is_shipped = set(), False
    for line in subprocess.run(["ninja", "-C", BUILD, "-t", "deps"], capture_output=True, text=True, check=True, timeout=60).stdout.splitlines():
        if line and not line.startswith(" "):
            is_shipped = line.startswith(("core/", "node/", "server/", "examples/demo/"))
        elif is_shipped and line.strip().startswith("/usr/include/"):
            files.add(line.strip())
    assert files
    # Headers of a Boost that was unpacked beside this machine's are not there.
    found = subprocess.run(["dpkg-query", "-S", *files], capture_output=True, text=True, check=True, timeout=60).stdout
    return {line.split(":")[0] for line in found.splitlines()} | {"libboost1.81-dev"}


def test_what_is_compiled_in_has_its_notice(tmp_path):
    # Of these, the shared libraries do the work. GCC's and the kernel's headers ask for no notice.
    linked = {"libc6-dev", "libjpeg62-turbo-dev", "libqrencode-dev", "libssl-dev", "libstdc++-12-dev", "libusb-1.0-0-dev", "linux-libc-dev",
              "zlib1g-dev"}
    compiled_in = json.loads((ROOT / "cmake/compiled_in.json").read_text())
    assert header_packages() - linked == set(compiled_in["programs"])
    (deb,) = PACKAGES.glob("rrgate_*_amd64.deb")
    (client,) = PACKAGES.glob("rrgate-client-*.tgz")
    subprocess.run(["dpkg-deb", "-x", deb, tmp_path], check=True, timeout=120)
    subprocess.run(["tar", "-xzf", client, "-C", tmp_path], check=True, timeout=60)
    share = tmp_path / "usr/share"
    for file, names in ((share / "doc/rrgate/third-party.txt", compiled_in["programs"]), (share / "rrgate/web/licenses.txt", compiled_in["wasm"]),
                        (tmp_path / "package/dist/licenses.txt", compiled_in["wasm"]), (share / "rrgate/docs/licenses.txt", ["vue", "vitepress"])):
        noticed = set(re.findall(r"^(\S+)(?: [0-9.]+)?\n=+$", file.read_text(), re.M))
        assert set(names) - noticed <= {"libboost1.81-dev"}, file  # which asks for none beside compiled code
        assert "Permission is hereby granted, free of charge" in file.read_text()
    named = set(re.findall(r"/(usr/share/\S+\.txt)", (share / "doc/rrgate/copyright").read_text()))
    assert len(named) == 3 and all((tmp_path / name).is_file() for name in named)


def test_the_bill_of_materials():
    """SPDX 2.3, chapters 6, 7 and 11: the fields that it must have."""
    (bill,) = PACKAGES.glob("rrgate-*.spdx.json")
    bill = json.loads(bill.read_text())
    assert (bill["spdxVersion"], bill["dataLicense"], bill["SPDXID"]) == ("SPDX-2.3", "CC0-1.0", "SPDXRef-DOCUMENT")
    assert bill["name"] and re.fullmatch(r"https://[^#\s]+", bill["documentNamespace"])
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", bill["creationInfo"]["created"])
    assert all(re.match("(Tool|Person|Organization): ", each) for each in bill["creationInfo"]["creators"])
    packages = {each["SPDXID"]: each for each in bill["packages"]}
    assert len(packages) == len(bill["packages"])
    for name, entry in packages.items():
        assert re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", name) and entry["name"] and entry["downloadLocation"] and entry["filesAnalyzed"] is False
        assert all(reference["referenceLocator"].startswith("pkg:") for reference in entry.get("externalRefs", []))
        assert entry["versionInfo"] != "unknown" or entry["name"].startswith("libboost"), name
    related = {}
    for each in bill["relationships"]:
        assert {each["spdxElementId"], each["relatedSpdxElement"]} <= {"SPDXRef-DOCUMENT", *packages}
        related.setdefault((each["spdxElementId"], each["relationshipType"]), set()).add(each["relatedSpdxElement"])
    assert len(related["SPDXRef-DOCUMENT", "DESCRIBES"]) == 1
    (product,) = related["SPDXRef-DOCUMENT", "DESCRIBES"]
    files = {packages[each]["name"]: each for each in related[product, "CONTAINS"]}
    shipped = [*PACKAGES.glob("*.deb"), *PACKAGES.glob("*.tgz")]
    assert len(shipped) == 3 and set(files) == {path.name for path in shipped}
    compiled_in = json.loads((ROOT / "cmake/compiled_in.json").read_text())
    for path in shipped:
        assert packages[files[path.name]]["checksums"] == [{"algorithm": "SHA256", "checksumValue": hashlib.sha256(path.read_bytes()).hexdigest()}]
        expected = {"rrgate-client-0": ["wasm"], "rrgate": ["programs", "wasm"], "rrgate-dev": []}[re.split(r"\.|_", path.name)[0]]
        inside = {packages[each]["name"] for each in related.get((files[path.name], "STATIC_LINK"), ())}
        assert inside == {name for kind in expected for name in compiled_in[kind]}, path.name


def test_what_the_packages_depend_on_is_in_debian(root):
    """By this Debian's own lists of packages; nothing of it is fetched."""
    debs = sorted(PACKAGES.glob("*_amd64.deb"))
    for deb in debs:
        shutil.copy(deb, root.folder)
    said = root.run("apt-get", "install", "--simulate", *(f"/{deb.name}" for deb in debs)).stdout
    installed = set(re.findall(r"^Inst (\S+) ", said, re.M))
    assert {"rrgate-dev", "libboost1.81-dev", "libssl-dev", "nlohmann-json3-dev"} <= installed, said


def test_what_is_where(root):
    assert root.run("stat", "-c", "%U:%G %a", "/etc/rrgate", "/etc/rrgate/gateway.json", "/var/lib/rrgate",
                    "/var/log/rrgate").stdout.split("\n")[:4] == \
        ["root:rrgate 750", "root:rrgate 640", "rrgate:rrgate 750", "rrgate:rrgate 750"]
    for path in ("usr/libexec/rrgate/rrgate-demo-create", "usr/share/rrgate/web/index.html.br", "usr/share/rrgate/docs/index.html", "usr/share/man/man1/rrgate.1.gz",
                 "usr/share/rrgate/gateway.schema.json", "lib/systemd/system/rrgate.socket",
                 "etc/apparmor.d/rrgate", "etc/apparmor.d/local/rrgate", "usr/lib/udev/rules.d/60-robotraconteur-usb.rules", "usr/share/doc/rrgate/copyright"):
        assert (root.folder / path).is_file(), path
    assert "good" in root.run("rrgate", "check-config", "--as-service", "rrgate", "/etc/rrgate/gateway.json").stdout


def test_each_command_has_a_man_page(root):
    def pages_of(*words):
        help_text = root.run(*words, "--help").stdout
        below = [page for name in re.findall(r"^  ([a-z][a-z-]+)  +[A-Z]", help_text, re.M) for page in pages_of(*words, name)]
        return ["-".join(words), *below]

    pages = pages_of("rrgate")
    assert {"rrgate-ls", "rrgate-cert", "rrgate-cert-ca", "rrgate-generate-ts"} <= set(pages)
    folder = root.folder / "usr/share/man/man1"
    assert sorted(pages) == sorted(path.name.removesuffix(".1.gz") for path in folder.iterdir() if path.name.startswith("rrgate"))
    for page in pages:
        text = gzip.decompress((folder / f"{page}.1.gz").read_bytes()).decode()
        assert re.search(rf'^\.TH {page.upper()} "1"', text, re.M) and re.search(rf"^{page} \\- \S", text, re.M), page
        assert text.count('.SH "SEE ALSO"') == 1 and "\\-\\-help" in text, page


@contextlib.contextmanager
def demo(root, log):
    """As whoever has just installed the package starts it. @yields it and the port of its page"""
    need("mount-namespaces")  # the demo looks into /proc for the programs beside it
    process = Background(["unshare", "--mount", "--propagation", "private", "sh", "-c",
                          'mount -t proc proc "$0/proc" && exec chroot "$0" "$@"', root.folder, "rrgate", "demo", "--no-browser",
                          "--port", str(free_port())], log)
    try:
        said = next(line for line in iter(process.next_line, None) if line.startswith("rrgate demo: "))  # its devices speak too
        yield process, int(re.fullmatch(r"rrgate demo: http://127\.0\.0\.1:(\d+)/", said)[1])
    finally:
        code = process.stop()
    assert code == 0


def test_the_demo_drives_its_robot_at_once(root, tmp_path):
    """Installing and trying it take less than 20 s of processor time."""
    before = processor_time()
    with demo(root, tmp_path / "log") as (process, port):
        robot = "/api/v1/devices/create/Create"
        first = ask(port, "GET", f"{robot}/state").json
        assert ask(port, "POST", f"{robot}/Drive", body={"velocity": 200, "radius": 32767}).status == 200
        process.wait_until(lambda: ask(port, "GET", f"{robot}/state").json["x"] != first["x"])
    assert root.installing + processor_time() - before < 20


def test_its_page_drives_the_robot(root, tmp_path):
    with demo(root, tmp_path / "log") as (_, port):
        page = subprocess.run(["node", JS / "drive_page.mjs", f"http://127.0.0.1:{port}/"], capture_output=True, text=True, timeout=60)
    assert page.returncode == 0, page.stderr
    seen = json.loads(page.stdout)
    assert seen["moved"] >= 0.1 and seen["errors"] == []


def test_a_program_is_built_with_the_development_package(tmp_path):
    """By what both packages have, and the libraries of this Debian."""
    for deb in PACKAGES.glob("*_amd64.deb"):
        subprocess.run(["dpkg-deb", "-x", deb, tmp_path / "root"], check=True, timeout=120)
    (tmp_path / "CMakeLists.txt").write_text("""
cmake_minimum_required(VERSION 3.25)
project(arm LANGUAGES CXX)
find_package(rrgate REQUIRED COMPONENTS node)
add_executable(arm main.cpp)
target_link_libraries(arm PRIVATE rrgate::node)
""")
    (program,) = re.findall(r"```cpp\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    (tmp_path / "main.cpp").write_text(program.replace("0.0.0.0:52222", "127.0.0.1:0").replace("node.run();", ""))
    prefixes = f"-DCMAKE_PREFIX_PATH={tmp_path}/root/usr;{ROOT}/build/deps/boost181/usr"
    for command in (["cmake", "-S", tmp_path, "-B", tmp_path / "build", prefixes], ["cmake", "--build", tmp_path / "build"]):
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
    subprocess.run([tmp_path / "build" / "arm"], check=True, timeout=10)


def set_up_lab(root, **changed):
    """By the commands and the configuration of the page, as they stand there, run by root in a root's shell."""
    section = DOCUMENT.read_text().split("## A lab in four commands")[1].split("\n## ")[0]
    (commands,) = re.findall(r"```sh\n(# in /etc/rrgate.*?)```", section, re.S)
    (config,) = re.findall(r"```json\n(.*?)```", section, re.S)
    shutil.rmtree(root.path("/etc/rrgate/lab"), ignore_errors=True)
    for name in ("users", "tokens"):
        root.path(f"/etc/rrgate/{name}").unlink(missing_ok=True)
    root.path("/etc/rrgate/gateway.json").write_text(json.dumps({**json.loads(config), **changed}))
    for line in commands.splitlines():
        command = line.split("#")[0].strip()
        if command:
            root.run("sh", "-c", f"umask 022; cd /etc/rrgate && {command}", given="secret\n")


def test_a_lab_in_four_commands(root, tmp_path):
    port = free_port()
    set_up_lab(root, listen=[f"127.0.0.1:{port}"])
    gateway = started(root, tmp_path / "log")
    try:
        authority = root.path("/etc/rrgate/lab/web-ca.pem").read_text()
        trust = {"context": ssl.create_default_context(cadata=authority)}
        trust["context"].check_hostname = False  # the page's host is gateway.lab
        assert answer_of(gateway, port, "/api/v1/devices", **trust).status == 401
        login = {"Authorization": "Basic " + base64.b64encode(b"root:secret").decode()}
        answer = ask(port, "GET", "/api/v1/devices", headers=login, **trust)
        assert answer.status == 200 and answer.json["devices"][0]["name"] == "create"
        assert ask(port, "PUT", "/api/v1/devices/create/Create/x", body=1, **trust).status == 401
        audit = root.path("/var/log/rrgate/audit.jsonl")
        assert audit.read_text().strip(), "nothing is in the audit log"
    finally:
        gateway.stop()


def test_a_folder_to_begin_with(root, tmp_path):
    root.run("install", "-d", "-g", "rrgate", "-m", "750", "/srv/lab")
    text = root.run("rrgate", "init", "/srv/lab", "--user", "root").stdout
    (password,) = re.findall(r"^user root, password ([a-z2-9]{20}) ", text, re.M)
    file = root.path("/srv/lab/gateway.json")
    port = free_port()
    assert "good" in root.run("rrgate", "check-config", "--as-service", "rrgate", "/srv/lab/gateway.json").stdout
    again = root.run("rrgate", "init", "/srv/lab", fails=True)
    assert (again.returncode, again.stderr) == (
        1, "rrgate init: /srv/lab/gateway.json: is there already, and says more than where to listen; nothing was written\n")
    file.write_text(file.read_text().replace("0.0.0.0:8443", f"127.0.0.1:{port}"))
    gateway = started(root, tmp_path / "log", "/srv/lab/gateway.json")
    try:
        trust = {"context": ssl.create_default_context(cadata=root.path("/srv/lab/tls/web-ca.pem").read_text())}
        assert answer_of(gateway, port, "/api/v1/devices", **trust).status == 401
        for given, status in ((password, 200), ("guess", 401)):
            login = {"Authorization": "Basic " + base64.b64encode(f"root:{given}".encode()).decode()}
            assert ask(port, "GET", "/api/v1/devices", headers=login, **trust).status == status
            assert ask(port, "GET", "/api/v1/devices", headers=login).status == 403  # in clear
    finally:
        gateway.stop()


def test_keys_of_cas_are_for_root(root):
    folder = "/etc/rrgate/keys"
    root.run("rrgate", "cert", "ca", folder)
    root.run("rrgate", "cert", "web", folder, "x.lab")
    modes = root.run("sh", "-c", f"cd {folder} && stat -c '%n %U:%G %a' . web-ca.key web-ca.pem x.lab.key x.lab.pem").stdout
    assert modes.splitlines() == [". root:rrgate 750", "web-ca.key root:root 600", "web-ca.pem root:rrgate 640",
                                  "x.lab.key root:rrgate 640", "x.lab.pem root:rrgate 640"]


def test_what_the_service_cannot_read_is_said(root):
    folder = root.path("/etc/rrgate/closed")
    folder.mkdir(mode=0o700)
    (folder / "users").write_text("")
    config = root.path("/etc/rrgate/other.json")
    config.write_text(json.dumps({"listen": ["127.0.0.1:1"], "devices": [], "access": {
        "users_file": "closed/users", "audit_file": "audit.jsonl"}}))
    config.chmod(0o644)
    assert root.run("rrgate", "check-config", "/etc/rrgate/other.json").returncode == 0
    result = root.run("rrgate", "check-config", "/etc/rrgate/other.json", "--as-service", "rrgate", fails=True)
    assert result.returncode == 2
    assert result.stderr.splitlines() == [
        'other.json: user \'rrgate\' can\'t read /etc/rrgate/closed/users: /etc/rrgate/closed belongs to root:root with mode 0700',
        'other.json: user \'rrgate\' can\'t write /etc/rrgate: /etc/rrgate belongs to root:rrgate with mode 0750']
    result = root.run("rrgate", "check-config", "/etc/rrgate/other.json", "--as-service", "nobody-here", fails=True)
    assert (result.returncode, result.stderr) == (1, "rrgate check-config: there is no user 'nobody-here' on this machine\n")


GUEST = r"""#!/bin/sh
exec > /dev/ttyS0 2>&1
tell() { printf 'MARK %s begin\n' "$1"; shift; "$@" 2>&1; printf 'MARK end %s\n' $?; }
answers() { for try in $(seq 100); do rrgate health "$1" > /dev/null 2>&1 && return; sleep 0.2; done; return 1; }
pid() { systemctl show rrgate -p MainPID --value; }
export RRGATE_PASSWORD=secret SSL_CERT_FILE=/etc/rrgate/lab/web-ca.pem
URL='https://gateway.lab:8443/devices/create?service=Create'
sed 's/ flags=(complain)//' /etc/apparmor.d/rrgate > /run/rrgate.profile
tell profile apparmor_parser -r /run/rrgate.profile
/usr/libexec/rrgate/rrgate-demo-create --port 52222 > /run/robot.log 2>&1 &
tell start systemctl start rrgate
tell state systemctl show rrgate -p ActiveState,SubState,User,NRestarts
tell confined cat /proc/$(pid)/attr/current
tell process grep -E '^(Uid|NoNewPrivs|Seccomp|CapEff):' /proc/$(pid)/status
tell call rrgate call "$URL" Drive 100 1000 --user root
tell reload systemctl reload rrgate
tell reloaded rrgate get "$URL" radius --user root
systemctl kill -s KILL rrgate
sleep 3
answers 127.0.0.1:8443
tell again rrgate get "$URL" radius --user root
tell restarts systemctl show rrgate -p ActiveState,NRestarts
tell stop systemctl stop rrgate
tell stopped systemctl show rrgate -p ActiveState,Result
tell audit rrgate audit --verify /var/log/rrgate/audit.jsonl
sed 's/"0.0.0.0:8443"/"127.0.0.1:8443"/' /etc/rrgate/gateway.json > /run/gateway.json && cat /run/gateway.json > /etc/rrgate/gateway.json
tell socket systemctl start rrgate.socket
tell woken answers 127.0.0.1:8080
tell "by socket" systemctl show rrgate -p ActiveState
tell denied sh -c "dmesg | grep -E 'apparmor=.(DENIED|ALLOWED)' || true"
tell log journalctl -u rrgate -u rrgate.socket --no-pager -o cat
echo MARK over
systemctl poweroff --force
"""


def test_systemd_runs_it_in_the_units_sandbox(root, tmp_path):
    """A Debian of its own, with Debian's kernel: the documented secure set-up, started, reloaded, killed and woken by its socket."""
    need("guest")
    root.run("apt-get", "install", "-y", "--no-install-recommends", "systemd-sysv", "apparmor")
    set_up_lab(root, devices=[{"name": "create", "url": "rr+tcp://127.0.0.1:52222/?service=Create", "mode": "shared"}])
    root.path("/etc/hosts").write_text("127.0.0.1 localhost gateway.lab\n")
    root.path("/root/guest.sh").write_text(GUEST)
    root.path("/etc/systemd/system/guest.service").write_text(
        "[Service]\nType=oneshot\nTimeoutStartSec=infinity\nExecStart=/bin/sh /root/guest.sh\n[Unit]\nAfter=apparmor.service\n")
    root.run("systemctl", "mask", "serial-getty@ttyS0.service", "getty@tty1.service")
    root.run("systemctl", "add-wants", "multi-user.target", "guest.service")
    initrd = tmp_path / "initrd.gz"
    make_initrd(initrd, "mount -t 9p -o trans=virtio,version=9p2000.L,rw,msize=262144,cache=loose host /host\n"
                "exec switch_root /host /sbin/init\n", ["virtio_pci", "9pnet_virtio", "9p"])
    text = subprocess.run([str(word) for word in qemu_command(
        initrd, root.folder, is_writable=True, kernel_options=("apparmor=1", "security=apparmor", "systemd.show_status=0"))],
        capture_output=True, text=True, errors="replace", timeout=GUEST_LIMIT).stdout.replace("\r", "")
    told = {name: (said.strip().splitlines(), int(code)) for name, said, code in
            re.findall(r"^MARK (.+?) begin\n(.*?)^MARK end (\d+)$", text, re.S | re.M)}
    assert "MARK over\n" in text, text[-4000:]
    failed = {name: answer for name, answer in told.items() if answer[1] != 0}
    assert not failed, (failed, told["denied"], told["log"])
    said = {name: answer[0] for name, answer in told.items()}
    assert set(said["state"]) == {"ActiveState=active", "SubState=running", "User=rrgate", "NRestarts=0"}
    assert said["confined"] == ["rrgate (enforce)"]
    about = dict(line.split(":\t", 1) for line in said["process"])
    assert about["Uid"].split()[0] != "0" and int(about["CapEff"], 16) == 0
    assert (about["NoNewPrivs"], about["Seccomp"]) == ("1", "2")
    assert said["reloaded"] == said["again"] and float(said["again"][0]) > 0
    assert set(said["restarts"]) == {"ActiveState=active", "NRestarts=1"}
    assert set(said["stopped"]) == {"ActiveState=inactive", "Result=success"}
    assert said["by socket"] == ["ActiveState=active"]
    assert said["denied"] == [], "what the unit forbids, it needs"


def test_purging_leaves_what_root_has_made(root):
    """The last of those that want the package."""
    links = [root.path(f"/etc/systemd/system/{target}.target.wants/rrgate.{kind}")
             for target, kind in (("multi-user", "service"), ("sockets", "socket"))]
    for link in links:  # as systemctl enable makes them
        link.parent.mkdir(parents=True, exist_ok=True)
        link.unlink(missing_ok=True)
        link.symlink_to(f"/lib/systemd/system/{link.name}")
    made = root.path("/etc/rrgate/made")
    made.touch()
    root.run("apt", "purge", "-y", "rrgate")
    # Caches and temporary folders are those of systemd and AppArmor, which ran in here.
    left = {"/" + str(path.relative_to(root.folder)) for folder in ("etc", "usr", "var/lib", "var/log")
            for path in (root.folder / folder).rglob("*rrgate*")}
    assert left == {"/etc/rrgate"}
    assert made.exists()


def test_the_unit_of_another_prefix_names_its_program(tmp_path):
    subprocess.run(["cmake", "--install", BUILD, "--prefix", tmp_path / "here", "--component", "unit"], check=True,
                   capture_output=True, timeout=60)
    text = (tmp_path / "here/share/rrgate/systemd/rrgate.service").read_text()
    assert f"\nExecStart={tmp_path}/here/bin/rrgate serve " in text
