#!/usr/bin/env python3
"""Checks that every #include and import points down the layers (docs/architecture.md).

check_layers.py ROOT    prints "file:line: what is wrong" for each finding; exit code 1 where there is one
"""
import pathlib
import re
import sys

# Each layer may include itself and those before it.
CORE_LAYERS = ["support", "hardware", "wire", "robdef", "types", "member", "session", "discovery"]

# What no file of core/ may include: input and output, threads and clocks belong to the drivers.
CORE_FORBIDDEN = re.compile(
    r"boost/(asio|beast|thread|fiber)|openssl/|libusb|nlohmann/|spdlog/|emscripten"
    r"|(thread|mutex|shared_mutex|condition_variable|future|atomic|stop_token|semaphore|latch|barrier|coroutine"
    r"|iostream|fstream|filesystem|sys/.*|unistd\.h|netinet/.*|arpa/.*)$"
)

# First folder of a project include -> folders whose files may include it.
MAY_INCLUDE = {
    "core": {"core", "server", "wasm-client", "test", "demo", "examples"},
    "server": {"server", "test", "demo", "examples"},
    "wasm-client": {"wasm-client", "test"},
    "test": {"test"},
}

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
IMPORT = re.compile(r"""(?:\bfrom\s*|\bimport\s*\(?\s*)["']([^"']+)["']""")


def check_cpp(path, line_number, system, included):
    top, *rest = path.parts
    target_top, *target_rest = pathlib.PurePosixPath(included).parts
    if top == "core" and CORE_FORBIDDEN.match(included):
        yield f"core must not include {included}: it does no input or output and knows no threads"
    if system or target_top not in MAY_INCLUDE:
        return
    if top not in MAY_INCLUDE[target_top]:
        yield f"{top}/ must not include {included}"
    if top == "core" and target_top == "core" and target_rest[0] in CORE_LAYERS and rest[0] in CORE_LAYERS:
        if CORE_LAYERS.index(target_rest[0]) > CORE_LAYERS.index(rest[0]):
            yield f"layer {rest[0]} must not include {included}: {target_rest[0]} stands above it"


def check_typescript(path, line_number, imported):
    if path.parts[0] == "web" and "wasm-client" in imported:
        yield f"web must import the client as rrgate-client, not {imported}"
    if path.parts[0] == "web" and imported.startswith("rrgate-client/"):
        yield f"web must import only the public entry of rrgate-client, not {imported}"


def findings(root):
    folders = [folder for folder in ("core", "server", "wasm-client", "web", "test", "demo", "examples") if (root / folder).is_dir()]
    for folder in folders:
        for file in sorted((root / folder).rglob("*")):
            path = file.relative_to(root)
            if {"node_modules", "dist"} & set(path.parts) or not file.is_file():
                continue
            if file.suffix in (".cpp", ".hpp"):
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
