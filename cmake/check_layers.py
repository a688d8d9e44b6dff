#!/usr/bin/env python3
"""Checks that every #include and import points down the layers (docs/architecture.md).

check_layers.py ROOT    prints "file:line: what is wrong" for each finding; exit code 1 where there is one
"""
import pathlib
import re
import sys

# The floors of the house, from the ground up: a folder may include itself and those before it. A folder that is not
# listed belongs to the one that it lies in.
FLOORS = """
core/support core/hardware core/wire
core/robdef/model core/robdef/parse core/robdef/verify core/robdef/format core/robdef
core/types core/member core/session core/session/client core/session/service core/discovery
node/platform node/tls node/transport node/http node/driver node/values node/client node/service node/discovery
node/subscribe node/generate
server/log server/json server/limits server/access server/http server/record server/config server/upstream server/recordings server/rr server/state server/relay
server/http/endpoints server/socket server/mcp server/front server/gateway server/cli server
""".split()

# Folders that stand beside each other, and know nothing of each other.
APART = [("core/session/client", "core/session/service"), ("node/client", "node/service")]

# What no file of core/ may include: input and output, threads and clocks belong to the drivers.
CORE_FORBIDDEN = re.compile(
    r"boost/(asio|beast|thread|fiber)|openssl/|libusb|nlohmann/|spdlog/|emscripten"
    r"|(thread|mutex|shared_mutex|condition_variable|future|atomic|stop_token|semaphore|latch|barrier|coroutine"
    r"|iostream|fstream|filesystem|sys/.*|unistd\.h|netinet/.*|arpa/.*)$"
)

# First folder of a project include -> folders whose files may include it.
MAY_INCLUDE = {
    "core": {"core", "node", "server", "wasm-client", "test", "include"},
    "node": {"node", "server", "test", "include"},
    "server": {"server", "test", "include"},
    "rrgate": {"examples", "test"},
    "examples": {"examples", "test"},
    "wasm-client": {"wasm-client", "test"},
    "test": {"test"},
}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
IMPORT = re.compile(r"""(?:\bfrom\s*|\bimport\s*\(?\s*)["']([^"']+)["']""")


def check_cpp(path, line_number, system, included):
    top = path.parts[0]
    target_top = pathlib.PurePosixPath(included).parts[0]
    if top == "core" and CORE_FORBIDDEN.match(included):
        yield f"core must not include {included}: it does no input or output and knows no threads"
    if system or target_top not in MAY_INCLUDE:
        return
    here, there = floor_of(path), floor_of(pathlib.PurePosixPath(included))
    if top not in MAY_INCLUDE[target_top]:
        yield f"{top}/ must not include {included}"
    elif (here, there) in APART or (there, here) in APART:
        yield f"{here} must not include {included}: {there} stands beside it"
    elif here in FLOORS and there in FLOORS and FLOORS.index(there) > FLOORS.index(here):
        yield f"{here} must not include {included}: {there} stands above it"


def floor_of(path):
    """The listed folder that a file belongs to; its own folder where none is listed."""
    for folder in path.parents:
        if str(folder) in FLOORS:
            return str(folder)
    return str(path.parent)


def check_place(path):
    """A folder without a floor could include whatever it likes, and be included by everybody."""
    has_floor = len(path.parts) < 3 or floor_of(path) in FLOORS and floor_of(path) != path.parts[0]
    if path.parts[0] in ("core", "node", "server") and not has_floor:
        yield f"{path.parent} has no floor: FLOORS of cmake/check_layers.py must list it"


def check_typescript(path, line_number, imported):
    if path.parts[0] == "web" and "wasm-client" in imported:
        yield f"web must import the client as rrgate-client, not {imported}"
    if path.parts[0] == "web" and imported.startswith("rrgate-client/"):
        yield f"web must import only the public entry of rrgate-client, not {imported}"


def findings(root):
    folders = [folder for folder in ("core", "node", "server", "include", "wasm-client", "web", "test", "examples") if (root / folder).is_dir()]
    for folder in folders:
        for file in sorted((root / folder).rglob("*")):
            path = file.relative_to(root)
            if {"node_modules", "dist"} & set(path.parts) or not file.is_file():
                continue
            if file.suffix in (".cpp", ".hpp"):
                for text in check_place(path):
                    yield f"{path}: {text}"
                for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                    if match := INCLUDE.match(line):
                        for text in check_cpp(path, number, match[1] == "<", match[2]):
                            yield f"{path}:{number}: {text}"
            elif file.suffix in (".ts", ".tsx", ".mts"):
                for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                    for imported in IMPORT.findall(line):
                        for text in check_typescript(path, number, imported):
                            yield f"{path}:{number}: {text}"


if __name__ == "__main__":
    wrong = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(wrong) if wrong else "layers: clean")
    sys.exit(1 if wrong else 0)
