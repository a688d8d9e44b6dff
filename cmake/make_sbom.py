#!/usr/bin/env python3
"""make_sbom.py --version V --output FILE PACKAGE.deb... PACKAGE.tgz... IMAGE.tar... package-lock.json...

What a release is made of, as SPDX 2.3 in JSON: the packages, the shared libraries that dpkg-shlibdeps found they need, what
they are compiled with (Depends of rrgate-dev), what is compiled into them (compiled_in.json), the Debian packages whose files are
in the container images, and the npm packages that are in the page or in the documentation, or come with the client.
Source: https://spdx.github.io/spdx-spec/v2.3/
"""
import argparse
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import tarfile


COMPILED_IN = json.loads(pathlib.Path(__file__).with_name("compiled_in.json").read_text())


def output_of(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()


def package(name, version, url=None, checksum=None):
    entry = {"SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", f"{name}-{version}"), "name": name, "versionInfo": version,
             "downloadLocation": "NOASSERTION", "filesAnalyzed": False, "licenseConcluded": "NOASSERTION",
             "licenseDeclared": "NOASSERTION", "copyrightText": "NOASSERTION"}
    if url:
        entry["externalRefs"] = [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": url}]
    if checksum:
        entry["checksums"] = [{"algorithm": "SHA256", "checksumValue": checksum}]
    return entry


def debian_package(name):
    """As it is installed here."""
    try:
        version = output_of("dpkg-query", "-W", "-f", "${Version}", name)
    except subprocess.CalledProcessError:  # Boost may be unpacked beside another one
        version = "unknown"
    return package(name, version, f"pkg:deb/debian/{name}@{version}")


def debian_dependencies(deb):
    """What a package depends on."""
    for each in output_of("dpkg-deb", "-f", deb, "Depends").split(","):
        name = each.split("|")[0].split("(")[0].strip()
        if name and not name.startswith("rrgate"):
            yield debian_package(name)


def compiled_in(path):
    """What the programs, and the core of the page and of the npm package, have in them. What rrgate-dev has, it depends on."""
    has_programs = path.suffix == ".tar" or path.name.startswith("rrgate_")
    kinds = ["programs", "wasm"] if has_programs else ["wasm"] if path.suffix == ".tgz" else []
    return [debian_package(name) for kind in kinds for name in COMPILED_IN[kind]]


def image_contents(image):
    """Debian packages of which files are in it, as it says itself."""
    with tarfile.open(image) as archive:
        (about,) = json.load(archive.extractfile("manifest.json"))
        for layer in about["Layers"]:
            with tarfile.open(fileobj=archive.extractfile(layer), mode="r:gz") as files:
                for member in files:
                    if member.isfile() and member.name.startswith("var/lib/dpkg/status.d/"):
                        fields = dict(re.findall(r"^([A-Z][A-Za-z-]*): (.*)$", files.extractfile(member).read().decode(), re.M))
                        name, version, architecture = (fields[key] for key in ("Package", "Version", "Architecture"))
                        is_ours = name == "rrgate"
                        entry = package(name, version, None if is_ours else f"pkg:deb/debian/{name}@{version}?arch={architecture}")
                        entry["SPDXID"] += f"-{architecture}"
                        if is_ours:
                            entry["licenseDeclared"] = "Apache-2.0"
                        yield entry


def npm_dependencies(lock):
    for path, about in json.loads(lock.read_text())["packages"].items():
        if path.startswith("node_modules/") and not about.get("dev") and not about.get("link"):
            name, version = path.rpartition("node_modules/")[2], about["version"]
            entry = package(name, version, f"pkg:npm/{name.replace('@', '%40')}@{version}")
            entry["licenseDeclared"] = about.get("license", "NOASSERTION")
            yield entry


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--version", required=True)
    parser.add_argument("--output", required=True, type=pathlib.Path)
    parser.add_argument("inputs", nargs="+", type=pathlib.Path)
    arguments = parser.parse_args()
    packages, relations = {}, set()
    product = package("rrgate", arguments.version)
    product["licenseDeclared"] = "Apache-2.0"
    product["SPDXID"] = "SPDXRef-product"
    packages[product["SPDXID"]] = product
    for path in arguments.inputs:
        owner = product
        if path.suffix == ".json":
            needed = [("DEPENDS_ON", entry) for entry in npm_dependencies(path)]
        else:
            owner = package(path.name, arguments.version, checksum=hashlib.sha256(path.read_bytes()).hexdigest())
            packages[owner["SPDXID"]] = owner
            relations.add((product["SPDXID"], "CONTAINS", owner["SPDXID"]))
            needed = [("STATIC_LINK", entry) for entry in compiled_in(path)]
            if path.suffix == ".tar":
                needed += [("CONTAINS", entry) for entry in image_contents(path)]
            else:
                owner["licenseDeclared"] = "Apache-2.0"
            if path.suffix == ".deb":
                needed += [("DEPENDS_ON", entry) for entry in debian_dependencies(path)]
        for kind, entry in needed:
            packages[entry["SPDXID"]] = entry
            relations.add((owner["SPDXID"], kind, entry["SPDXID"]))
    made = datetime.datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), datetime.timezone.utc)
    content = sorted(packages.values(), key=lambda entry: entry["SPDXID"])
    digest = hashlib.sha256(json.dumps(content).encode()).hexdigest()
    document = {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"rrgate-{arguments.version}",
        "documentNamespace": f"https://spdx.org/spdxdocs/rrgate-{arguments.version}-{digest}",
        "creationInfo": {"created": made.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: make_sbom.py"]},
        "packages": content,
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                           "relatedSpdxElement": "SPDXRef-product"}] +
                         [{"spdxElementId": one, "relationshipType": kind, "relatedSpdxElement": other}
                          for one, kind, other in sorted(relations)]}
    arguments.output.write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    main()
