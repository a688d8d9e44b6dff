#!/usr/bin/env python3
"""What the container image of a package has in it, from packages with small ELF files of both architectures."""
import gzip
import hashlib
import io
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tarfile
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
MACHINES = {"amd64": (62, "/lib64/ld-linux-x86-64.so.2", "x86_64-linux-gnu"),
            "arm64": (183, "/lib/ld-linux-aarch64.so.1", "aarch64-linux-gnu")}


def elf(architecture, needed=(), interpreter=None):
    """A file of this kind that asks for these libraries, loaded at an address that is not its place in the file."""
    strings, places = b"\0", []
    for name in needed:
        places.append(len(strings))
        strings += name.encode() + b"\0"
    path = interpreter.encode() + b"\0" if interpreter else b""
    kinds = [1, 2] + ([3] if path else [])
    text = 64 + 56 * len(kinds)
    dynamic = text + len(strings) + len(path)
    base = 0x400000
    tags = [(1, place) for place in places] + [(5, base + text), (0, 0)]
    end = dynamic + 16 * len(tags)
    spans = {1: (0, end), 2: (dynamic, end), 3: (text + len(strings), dynamic)}
    header = b"\x7fELF\2\1\1" + bytes(9) + struct.pack("<HHIQQQIHHHHHH", 3, MACHINES[architecture][0], 1, 0, 64, 0, 0, 64, 56, len(kinds), 0, 0, 0)
    segments = b"".join(struct.pack("<IIQQQQQQ", kind, 5, begin, base + begin, 0, stop - begin, stop - begin, 8)
                        for kind, (begin, stop) in ((kind, spans[kind]) for kind in kinds))
    return header + segments + strings + path + b"".join(struct.pack("<qQ", *tag) for tag in tags)


class Image(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def put_deb(self, folder, name, architecture, files, links={}):
        """Builds a package; files by their place in it."""
        root = self.folder / "root" / architecture / name
        control = f"Package: {name}\nVersion: 1.2\nArchitecture: {architecture}\nMaintainer: nobody <n@example.invalid>\nDescription: x\n"
        for place, data in {"DEBIAN/control": control.encode(), **files}.items():
            path = root / place
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            path.chmod(0o755 if data.startswith(b"\x7fELF") else 0o644)
        for place, target in links.items():
            (root / place).parent.mkdir(parents=True, exist_ok=True)
            (root / place).unlink(missing_ok=True)
            (root / place).symlink_to(target)
        (self.folder / folder).mkdir(exist_ok=True)
        out = self.folder / folder / f"{name}_1.2_{architecture}.deb"
        subprocess.run(["dpkg-deb", "--root-owner-group", "-b", root, out], check=True, stdout=subprocess.DEVNULL)
        return out

    def put_packages(self, architecture):
        _, interpreter, triplet = MACHINES[architecture]
        program = elf(architecture, ["libc.so.6", "libssl.so.3"], interpreter)
        ours = self.put_deb("ours", "rrgate", architecture, {
            "usr/bin/rrgate": program, "usr/libexec/rrgate/rrgate-demo-create": elf(architecture, ["libc.so.6"], interpreter),
            "usr/share/rrgate/web/index.html": b"page", "usr/share/doc/rrgate/third-party.txt": b"notices", "lib/systemd/system/rrgate.service": b"unit"})
        # As Debian has them: some in /lib, some in /usr/lib, the names of a library and of the interpreter links.
        self.put_deb("debian", "libc6", architecture, {
            f"lib/{triplet}/libc.so.6": elf(architecture, [interpreter.split("/")[-1]]),
            f"lib/{triplet}/{interpreter.split('/')[-1]}": elf(architecture), "usr/share/doc/libc6/copyright": b"terms of libc"},
            {interpreter[1:]: f"/lib/{triplet}/{interpreter.split('/')[-1]}"})
        self.put_deb("debian", "libssl3", architecture, {
            f"usr/lib/{triplet}/libssl.so.3.0": elf(architecture, ["libcrypto.so.3"]), f"usr/lib/{triplet}/libcrypto.so.3": elf(architecture, ["libc.so.6"]),
            f"usr/lib/{triplet}/libunused.so.1": elf(architecture)},
            {f"usr/lib/{triplet}/libssl.so.3": "libssl.so.3.0", "usr/share/doc/libssl3": "openssl-base"})
        self.put_deb("debian", "openssl-base", architecture, {f"usr/lib/{triplet}/libother.so.1": elf(architecture),
                                                              "usr/share/doc/openssl-base/copyright": b"terms of both"})
        self.put_deb("debian", "ca-certificates", "all", {
            "usr/share/ca-certificates/mozilla/B.crt": b"second\n", "usr/share/ca-certificates/mozilla/A.crt": b"first\n",
            "usr/share/doc/ca-certificates/copyright": b"terms of the CAs"})
        return ours

    def run_tool(self, package, name="image.tar"):
        out = self.folder / name
        done = subprocess.run(
            [sys.executable, "-B", ROOT / "cmake/make_image.py", "--package", package, "--debian", self.folder / "debian",
             "--dockerfile", ROOT / "docker/Dockerfile", "--config", ROOT / "docker/gateway.json", "--output", out],
            capture_output=True, text=True, env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}, timeout=60, check=False)
        return done, out

    def test_both_architectures_have_what_their_programs_need(self):
        for architecture, (_, interpreter, triplet) in MACHINES.items():
            with self.subTest(architecture):
                shutil.rmtree(self.folder / "debian", ignore_errors=True)
                package = self.put_packages(architecture)
                done, out = self.run_tool(package)
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.check(out, architecture, interpreter, triplet)
                again = self.run_tool(package, "again.tar")[1]
                self.assertEqual(out.read_bytes(), again.read_bytes())

    def check(self, out, architecture, interpreter, triplet):
        with tarfile.open(out) as tar:
            files = {member.name: tar.extractfile(member).read() for member in tar}
        for name, data in files.items():
            if name.startswith("blobs/"):
                self.assertEqual(name, "blobs/sha256/" + hashlib.sha256(data).hexdigest())
        (entry,) = json.loads(files["index.json"])["manifests"]
        self.assertEqual(entry["platform"], {"architecture": architecture, "os": "linux"})
        blob = lambda about: files["blobs/" + about["digest"].replace(":", "/")]  # noqa: E731
        manifest = json.loads(blob(entry))
        config = json.loads(blob(manifest["config"]))
        layer = gzip.decompress(blob(manifest["layers"][0]))
        self.assertEqual(config["rootfs"]["diff_ids"], ["sha256:" + hashlib.sha256(layer).hexdigest()])
        self.assertEqual((config["architecture"], config["os"], config["created"]), (architecture, "linux", "2023-11-14T22:13:20Z"))
        start = config["config"]
        self.assertEqual((start["User"], start["Entrypoint"], start["ExposedPorts"]), ("10001:10001", ["/usr/bin/rrgate"], {"8080/tcp": {}}))
        self.assertEqual(start["Cmd"], ["serve", "--config", "/etc/rrgate/gateway.json"])
        self.assertIn("RRGATE_DEMO_LAN=1", start["Env"])
        self.assertEqual(start["Healthcheck"], {"Test": ["CMD", "/usr/bin/rrgate", "health", "127.0.0.1:8080"], "Interval": 10 * 10**9,
                                                "Timeout": 5 * 10**9, "StartPeriod": 10 * 10**9})
        (docker,) = json.loads(files["manifest.json"])
        self.assertEqual(docker["RepoTags"], ["rrgate:1.2"])
        self.assertEqual(json.loads(files[docker["Config"]]), config)
        with tarfile.open(fileobj=io.BytesIO(layer)) as tar:
            members = {member.name: member for member in tar}
            self.assertEqual(tar.extractfile("etc/ssl/certs/ca-certificates.crt").read(), b"first\nsecond\n")
        self.assertIn("ROBOTRACONTEUR_USER_HOME=/var/lib/rrgate", start["Env"])
        self.assertIn("SSL_CERT_FILE=/etc/ssl/certs/ca-certificates.crt", start["Env"])
        self.assertEqual({name for name, member in members.items() if member.isfile()}, {
            "usr/bin/rrgate", "usr/libexec/rrgate/rrgate-demo-create", "usr/share/rrgate/web/index.html", "usr/share/doc/rrgate/third-party.txt", interpreter[1:],
            f"usr/lib/{triplet}/{interpreter.split('/')[-1]}", "etc/passwd", "etc/group", "etc/rrgate/gateway.json", "usr/share/doc/libc6/copyright",
            "usr/share/doc/libssl3/copyright", "usr/share/doc/ca-certificates/copyright", "etc/ssl/certs/ca-certificates.crt", *(f"usr/lib/{triplet}/{name}" for name in ("libc.so.6", "libssl.so.3", "libcrypto.so.3")),
            *(f"var/lib/dpkg/status.d/{name}" for name in ("rrgate", "libc6", "libssl3", "ca-certificates"))})
        self.assertEqual((members["tmp"].mode, members["usr/bin/rrgate"].mode, members["etc/passwd"].mode), (0o1777, 0o755, 0o644))
        written = {name: member.mode for name, member in members.items() if (member.uid, member.gid) == (10001, 10001)}
        self.assertEqual(written, {"var/lib/rrgate": 0o750, "var/log/rrgate": 0o750})
        self.assertIn("var/log", members)
        self.assertTrue(all((member.uid, member.gid) == (0, 0) for name, member in members.items() if name not in written))
        self.assertTrue(all(member.mtime == 1700000000 for member in members.values()))

    def test_the_bill_of_materials_has_the_packages_in_the_image(self):
        done, image = self.run_tool(self.put_packages("arm64"))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        out = self.folder / "image.spdx.json"
        subprocess.run([sys.executable, "-B", ROOT / "cmake/make_sbom.py", "--version", "1.2", "--output", out, image],
                       env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}, timeout=60, check=True)
        bill = json.loads(out.read_text())
        packages = {each["SPDXID"]: each for each in bill["packages"]}
        (archive,) = [each for each in packages.values() if each["name"] == "image.tar"]
        self.assertEqual(archive["checksums"], [{"algorithm": "SHA256", "checksumValue": hashlib.sha256(image.read_bytes()).hexdigest()}])
        inside = [packages[each["relatedSpdxElement"]] for each in bill["relationships"]
                  if (each["spdxElementId"], each["relationshipType"]) == (archive["SPDXID"], "CONTAINS")]
        self.assertEqual(sorted((each["name"], each["versionInfo"], [ref["referenceLocator"] for ref in each.get("externalRefs", [])])
                                for each in inside),
                         [("ca-certificates", "1.2", ["pkg:deb/debian/ca-certificates@1.2?arch=all"]), ("libc6", "1.2", ["pkg:deb/debian/libc6@1.2?arch=arm64"]), ("libssl3", "1.2", ["pkg:deb/debian/libssl3@1.2?arch=arm64"]),
                          ("rrgate", "1.2", [])])

    def test_what_no_package_has_is_named(self):
        for lacking, sentence in (("libssl3", "no package has the library libssl.so.3"), ("ca-certificates", "no package has CAs")):
            with self.subTest(lacking):
                package = self.put_packages("amd64")
                next(self.folder.glob(f"debian/{lacking}_*")).unlink()
                done, out = self.run_tool(package)
                self.assertNotEqual(done.returncode, 0)
                self.assertIn(sentence, done.stderr)
                self.assertFalse(out.exists())

    def test_programs_and_libraries_of_two_architectures_are_refused(self):
        package = self.put_packages("amd64")
        foreign = self.put_deb("debian", "foreign", "arm64", {"usr/lib/x": elf("arm64")})
        self.assertIn("expected packages for amd64, found foreign_1.2_arm64.deb", self.run_tool(package)[0].stderr)
        foreign.unlink()
        wrong = self.put_deb("ours", "rrgate", "amd64", {"usr/bin/rrgate": elf("arm64")})
        self.assertIn("usr/bin/rrgate: expected ELF for amd64, found machine 183", self.run_tool(wrong)[0].stderr)


if __name__ == "__main__":
    unittest.main()
