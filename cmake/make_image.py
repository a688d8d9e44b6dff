#!/usr/bin/env python3
"""make_image.py --package rrgate_V_ARCH.deb --debian FOLDER --dockerfile FILE --config gateway.json --output IMAGE.tar

A container image of a Debian package, for any architecture, without running anything of it: the package's programs, page
and documentation, the shared libraries that the programs need and Debian's CAs, out of the packages in FOLDER, and what the last stage of the
Dockerfile says of how it is started. The archive is an OCI layout that has the index of `docker save` beside it: podman and
Docker load it. Its manifest is of Docker's type, since podman ignores the health check of OCI's. The same inputs give the same
bytes (times are SOURCE_DATE_EPOCH).
Source: https://github.com/opencontainers/image-spec (layout, manifest, config, layer), gABI chapter 5 (ELF)
"""
import argparse
import datetime
import gzip
import hashlib
import io
import json
import os
import pathlib
import posixpath
import re
import shlex
import struct
import subprocess
import tarfile

TAKEN = ("usr/bin/rrgate", "usr/libexec/rrgate/", "usr/share/rrgate/", "usr/share/doc/rrgate/copyright",
         "usr/share/doc/rrgate/third-party.txt")
USERS = {"etc/passwd": b"rrgate:x:10001:10001::/:/nonexistent\n", "etc/group": b"rrgate:x:10001:\n"}
# What a gateway writes, for volumes: a new one takes owner and mode from here.
WRITTEN = ("var/lib/rrgate", "var/log/rrgate")
USER = 10001
CAS, CA_BUNDLE = "usr/share/ca-certificates/mozilla/", "etc/ssl/certs/ca-certificates.crt"
TRIPLETS = {"amd64": "x86_64-linux-gnu", "arm64": "aarch64-linux-gnu"}
ELF_MACHINES = {"amd64": 62, "arm64": 183}
MANIFEST = "application/vnd.docker.distribution.manifest.v2+json"
SECONDS = {"s": 1, "m": 60}


class Deb:
    """A package's files (name without the first "/": mode and bytes) and links, and its control fields."""

    def __init__(self, path):
        self.path = path
        self.control = output_of("dpkg-deb", "-f", path).decode()
        self.name, self.architecture = (self.field(key) for key in ("Package", "Architecture"))
        self.files, self.links = {}, {}
        with tarfile.open(fileobj=io.BytesIO(output_of("dpkg-deb", "--fsys-tarfile", path))) as tar:
            for member in tar:
                name = merged_usr(member.name.removeprefix("./"))
                if member.isreg():
                    self.files[name] = (member.mode, tar.extractfile(member).read())
                elif member.issym():
                    self.links[name] = posixpath.normpath(posixpath.join("/", posixpath.dirname(name), member.linkname))[1:]
                elif member.islnk():
                    self.files[name] = self.files[merged_usr(member.linkname.removeprefix("./"))]

    def field(self, key):
        return re.search(rf"^{key}: (\S+)", self.control, re.M)[1]


def output_of(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout


def merged_usr(name):
    """Debian's /lib is /usr/lib."""
    return re.sub(r"^(lib|lib64)/", r"usr/\1/", name)


def needs_of(name, elf, architecture):
    """The interpreter, or None, and the names of the shared libraries that a program or a library asks for."""
    if elf[4:6] != b"\2\1" or struct.unpack_from("<H", elf, 18)[0] != ELF_MACHINES[architecture]:
        raise SystemExit(f"{name}: expected ELF for {architecture}, found machine {struct.unpack_from('<H', elf, 18)[0]}")
    offset, (size, count) = struct.unpack_from("<Q", elf, 32)[0], struct.unpack_from("<HH", elf, 54)
    segments = [struct.unpack_from("<IIQQQQ", elf, offset + each * size) for each in range(count)]
    interpreter, loads, dynamic = None, [], None
    for kind, _, start, address, _, length in segments:
        if kind == 1:
            loads.append((address, start, length))
        elif kind == 2:
            dynamic = list(struct.iter_unpack("<qQ", elf[start:start + length // 16 * 16]))
        elif kind == 3:
            interpreter = elf[start:start + length].rstrip(b"\0").decode()
    if dynamic is None:
        return interpreter, []
    strings = next(value for tag, value in dynamic if tag == 5)
    strings = next(strings - address + start for address, start, length in loads if address <= strings < address + length)
    texts = [strings + value for tag, value in dynamic if tag == 1]
    return interpreter, [elf[text:elf.index(b"\0", text)].decode() for text in texts]


class Libraries:
    """The shared libraries of Debian's packages."""

    def __init__(self, folder, architecture):
        self.debs = [Deb(path) for path in sorted(folder.glob("*.deb"))]
        wrong = [deb.path.name for deb in self.debs if deb.architecture not in (architecture, "all")]
        if wrong:
            raise SystemExit(f"{folder}: expected packages for {architecture}, found {', '.join(wrong)}")
        self.folders = [f"usr/lib/{TRIPLETS[architecture]}", "usr/lib"]

    def find(self, name):
        """The package and the bytes of a soname, or of a whole path as interpreters have it."""
        places = [merged_usr(name[1:])] if name.startswith("/") else [f"{folder}/{name}" for folder in self.folders]
        for place in places:
            for deb in self.debs:
                path = place
                for _ in range(8):  # links of links
                    path = merged_usr(deb.links.get(path, path))
                if path in deb.files:
                    return deb, deb.files[path][1]
        raise SystemExit(f"no package has the library {name}; there are {', '.join(deb.name for deb in self.debs)}")


def tree_of(package, libraries, config):
    """All files of the image: name to mode and bytes."""
    tree = {name: entry for name, entry in package.files.items() if name.startswith(TAKEN)}
    if "usr/bin/rrgate" not in tree:
        raise SystemExit(f"{package.path.name}: has no /usr/bin/rrgate")
    used, wanted = {package.name: package}, [(name, data) for name, (_, data) in tree.items() if data[:4] == b"\x7fELF"]
    known = set()
    while wanted:
        interpreter, needed = needs_of(*wanted.pop(), package.architecture)
        for each in [interpreter, *needed]:
            if each is None or each in known:
                continue
            known.add(each)
            deb, data = libraries.find(each)
            used[deb.name] = deb
            place = each[1:] if each.startswith("/") else f"{libraries.folders[0]}/{each}"
            tree[place] = (0o755, data)
            wanted.append((each, data))
    for deb in libraries.debs:
        # The package's script would put them into one file when it is installed.
        if cas := [data for name, (_, data) in sorted(deb.files.items()) if name.startswith(CAS) and name.endswith(".crt")]:
            tree[CA_BUNDLE] = (0o644, b"".join(cas))
            used[deb.name] = deb
    if CA_BUNDLE not in tree:
        raise SystemExit(f"no package has CAs; there are {', '.join(deb.name for deb in libraries.debs)}")
    # Scanners for known weaknesses look here where there is no dpkg.
    for name, deb in used.items():
        tree[f"var/lib/dpkg/status.d/{name}"] = (0o644, deb.control.encode())
        # The terms of several packages of one source are in one of them.
        terms = deb.links.get(f"usr/share/doc/{name}", f"usr/share/doc/{name}") + "/copyright"
        for data in [each.files[terms][1] for each in (deb, *libraries.debs) if terms in each.files][:1]:
            tree[f"usr/share/doc/{name}/copyright"] = (0o644, data)
    tree["etc/rrgate/gateway.json"] = (0o644, config)
    return tree | {name: (0o644, text) for name, text in USERS.items()}


def layer_of(tree, epoch):
    folders = {str(parent) for name in [*tree, *WRITTEN] for parent in pathlib.PurePosixPath(name).parents} - {"."} | {"tmp", *WRITTEN}
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.PAX_FORMAT) as tar:
        for name in sorted(folders | set(tree)):
            entry = tarfile.TarInfo(name)
            entry.mtime = epoch
            if name in tree:
                entry.mode, data = tree[name]
                entry.size = len(data)
                tar.addfile(entry, io.BytesIO(data))
            else:
                entry.type, entry.mode = tarfile.DIRTYPE, 0o1777 if name == "tmp" else 0o755
                if name in WRITTEN:
                    entry.mode, entry.uid, entry.gid = 0o750, USER, USER
                tar.addfile(entry)
    return buffer.getvalue()


def start_of(dockerfile):
    """What the last stage says of how the image is started, as image configurations have it."""
    out = {}
    for line in dockerfile.split("\nFROM ")[-1].splitlines():
        word, _, rest = line.partition(" ")
        if word == "USER":
            out["User"] = rest
        elif word == "EXPOSE":
            out["ExposedPorts"] = {f"{port}/tcp": {} for port in rest.split()}
        elif word == "ENV":
            out.setdefault("Env", ["PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"]).extend(shlex.split(rest))
        elif word in ("ENTRYPOINT", "CMD"):
            out[word.capitalize()] = json.loads(rest)
        elif word == "HEALTHCHECK":
            options, command = rest.split("CMD ", 1)
            out["Healthcheck"] = {"Test": ["CMD", *json.loads(command)]} | {
                "".join(part.capitalize() for part in name.split("-")): int(number) * SECONDS[unit] * 10**9
                for name, number, unit in re.findall(r"--([a-z-]+)=(\d+)([sm])\b", options)}
    out["Entrypoint"] = out.pop("Entrypoint")
    return out


def make_image(package, libraries, dockerfile, config, epoch):
    """The archive's files, by name."""
    files = {}

    def put(data, kind):
        digest = hashlib.sha256(data).hexdigest()
        files[f"blobs/sha256/{digest}"] = data
        return {"mediaType": f"application/vnd.docker.{kind}", "digest": f"sha256:{digest}", "size": len(data)}

    def put_json(value, kind):
        return put(json.dumps(value, separators=(",", ":")).encode(), kind)

    layer = layer_of(tree_of(package, libraries, config), epoch)
    created = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    version = package.field("Version")
    labels = {"org.opencontainers.image.title": "rrgate", "org.opencontainers.image.version": version,
              "org.opencontainers.image.licenses": "Apache-2.0"}
    about = put_json({"created": created, "architecture": package.architecture, "os": "linux",
                      "config": start_of(dockerfile) | {"Labels": labels},
                      "rootfs": {"type": "layers", "diff_ids": ["sha256:" + hashlib.sha256(layer).hexdigest()]},
                      "history": [{"created": created, "created_by": f"make_image.py {package.path.name}"}]}, "container.image.v1+json")
    packed = put(gzip.compress(layer, 9, mtime=0), "image.rootfs.diff.tar.gzip")
    manifest = put_json({"schemaVersion": 2, "mediaType": MANIFEST, "config": about, "layers": [packed]}, "distribution.manifest.v2+json")
    manifest["platform"] = {"architecture": package.architecture, "os": "linux"}
    manifest["annotations"] = {"org.opencontainers.image.ref.name": version, "io.containerd.image.name": f"docker.io/library/rrgate:{version}"}
    path_of = {"config": about, "layer": packed}
    path_of = {name: "blobs/" + entry["digest"].replace(":", "/") for name, entry in path_of.items()}
    files["oci-layout"] = b'{"imageLayoutVersion":"1.0.0"}'
    files["index.json"] = json.dumps({"schemaVersion": 2, "mediaType": "application/vnd.oci.image.index.v1+json",
                                      "manifests": [manifest]}).encode()
    files["manifest.json"] = json.dumps([{"Config": path_of["config"], "RepoTags": [f"rrgate:{version}"],
                                          "Layers": [path_of["layer"]]}]).encode()
    return files


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--package", required=True, type=pathlib.Path)
    parser.add_argument("--debian", required=True, type=pathlib.Path)
    parser.add_argument("--dockerfile", required=True, type=pathlib.Path)
    parser.add_argument("--config", required=True, type=pathlib.Path)
    parser.add_argument("--output", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    epoch = int(os.environ["SOURCE_DATE_EPOCH"])
    package = Deb(arguments.package)
    files = make_image(package, Libraries(arguments.debian, package.architecture), arguments.dockerfile.read_text(),
                       arguments.config.read_bytes(), epoch)
    with tarfile.open(arguments.output, "w", format=tarfile.USTAR_FORMAT) as tar:
        for name, data in sorted(files.items()):
            entry = tarfile.TarInfo(name)
            entry.size, entry.mtime = len(data), epoch
            tar.addfile(entry, io.BytesIO(data))


if __name__ == "__main__":
    main()
