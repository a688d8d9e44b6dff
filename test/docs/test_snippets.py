"""Code in the pages is code: it compiles, parses, or is a configuration that the gateway takes. Files of examples, which pages show
as they are, are built and run by test/examples."""
import ast
import html.parser
import json
import os
import re
import shlex
import subprocess

import pytest

from cpp_frames import DEFINITION, FRAMES, INCLUDES
from pages import ROOT, blocks, find, unknown
from processes import BUILD

RRGATE = BUILD / "server" / "rrgate"
LANGUAGES = {"", "cmake", "cpp", "http", "html", "js", "json", "jsx", "matlab", "python", "sh", "svelte", "ts", "txt", "vue"}


def of(*languages):
    return [pytest.param(block, id=str(block)) for block in blocks() if block.language in languages and not block.file]


def run(*command, **how):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=120, check=False, **how)


def check_javascript(text, folder, name="block.mjs"):
    (folder / name).write_text(text)
    done = run("node", "--check", folder / name)
    assert done.returncode == 0, done.stderr


def test_languages_are_known():
    assert {block.language for block in blocks()} <= LANGUAGES


@pytest.mark.parametrize("block", of("js"))
def test_javascript(block, tmp_path):
    check_javascript(block.text, tmp_path)


# By the compilers of the frameworks, which the client's own tests use.
COMPILERS = {
    "jsx": 'import { transformWithOxc } from "vite"; await transformWithOxc(text, "block.jsx");',
    "vue": """
import { compileScript, compileTemplate, parse } from "vue/compiler-sfc";
const { descriptor, errors } = parse(text);
if (errors.length) throw errors[0];
const { bindings } = compileScript(descriptor, { id: "block" });
const { errors: wrong } = compileTemplate({ id: "block", source: descriptor.template.content, filename: "block.vue",
  compilerOptions: { bindingMetadata: bindings } });
if (wrong.length) throw wrong[0];""",
    "svelte": 'import { compile } from "svelte/compiler"; compile(text, { filename: "block.svelte" });',
}


@pytest.mark.parametrize("block", of(*COMPILERS))
def test_component(block):
    done = run("node", "--input-type=module", "-e", f"const text = {json.dumps(block.text)};\n{COMPILERS[block.language]}",
               cwd=ROOT / "wasm-client")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("block", of("html"))
def test_html(block, tmp_path):
    scripts = []

    class Reader(html.parser.HTMLParser):
        def handle_data(self, data):
            if self.cdata_elem == "script":
                scripts.append(data)

    Reader().feed(block.text)
    assert ("<script" in block.text) == bool(scripts)
    for script in scripts:
        check_javascript(script, tmp_path, "block.js")


def test_python():
    for block in (block for block in blocks() if block.language == "python"):
        assert ast.parse(block.text, str(block)).body


@pytest.mark.parametrize("block", of("sh"))
def test_shell(block):
    if not block.is_transcript:  # those are run
        done = run("bash", "-n", "-c", block.text.replace("<this repository>", "repository"))
        assert done.returncode == 0, done.stderr
    assert block.text.strip()


@pytest.mark.parametrize("block", of("cmake"))
def test_cmake(block, tmp_path):
    (tmp_path / "block.cmake").write_text(f"return()\n{block.text}")  # all of it is read before the first line is done
    done = run("cmake", "-P", tmp_path / "block.cmake")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("block", of("json"))
def test_configuration(block, tmp_path):
    """As it is, or in the place that it is for. Files that it names are not there, and what it leaves out may deserve a
    warning: that alone may be said of it."""
    found = json.loads(block.text if block.text.startswith("{") else f"{{{block.text}}}")
    if "listen" not in found:
        found = {"devices": [found]} if "url" in found else {"devices": [], **found}
    (tmp_path / "gateway.json").write_text(json.dumps({"listen": ["127.0.0.1:8080"], **found}))
    done = run(RRGATE, "check-config", tmp_path / "gateway.json")
    findings = [line for line in done.stderr.splitlines() if not re.search("No such file or directory|can't be read|: warning: missing: ", line)]
    assert (done.stdout or done.stderr) and findings == []


def test_configurations_take_no_password_in_clear():
    """Where there are certificates for TLS and users: what check-config warns of, where it finds the files."""
    configurations = [json.loads(block.text) for block in blocks() if block.language == "json" and '"certificates"' in block.text]
    assert len(configurations) > 1 and [each["tls"] for each in configurations if not each["tls"].get("required")] == []


def test_typescript(tmp_path):
    (tmp_path / "node_modules").mkdir()
    (tmp_path / "node_modules/rrgate-client").symlink_to(ROOT / "wasm-client")
    made = run(RRGATE, "generate", "ts", ROOT / "robdef/modern/experimental.create2.robdef", "-o", tmp_path / "create.d.ts")
    assert made.returncode == 0, made.stderr
    files = []
    for number, block in enumerate(block for block in blocks() if block.language == "ts"):
        files.append(tmp_path / f"block{number}.mts")
        files[-1].write_text(f"// {block}\n{block.text}")
    done = run(ROOT / "wasm-client/node_modules/.bin/tsc", "--noEmit", "--strict", "--target", "es2022", "--module", "nodenext",
               "--skipLibCheck", *files, cwd=tmp_path)
    assert files and done.returncode == 0, done.stdout


def test_cpp(tmp_path):
    """All fragments in one file, since most of the time goes into the headers."""
    assert unknown(FRAMES) == []
    (tmp_path / "com.example.robot.robdef").write_text(DEFINITION)
    made = run(RRGATE, "generate", "cpp", tmp_path / "com.example.robot.robdef", "-o", tmp_path)
    assert made.returncode == 0, made.stderr
    text = INCLUDES
    for block in (block for block in blocks() if block.language == "cpp" and not block.file and not is_program(block)):
        frame = find(FRAMES, block)
        assert frame, f"{block}: what stands around this fragment is to be named in cpp_frames.py"
        text += f"{frame[0]}#line {block.line + 1} \"{block.page}\"\n{block.text}{frame[1]}"
    (tmp_path / "pages.cpp").write_text(text)
    done = run(*compiler(), "-fsyntax-only", "-w", f"-I{tmp_path}", tmp_path / "pages.cpp", env={**os.environ, "LC_ALL": "C"})
    assert done.returncode == 0, done.stderr[:4000]


def is_program(block):
    return "int main(" in block.text


@pytest.mark.parametrize("block", [case for case in of("cpp") if is_program(case.values[0])])
def test_a_program_compiles_as_it_is_printed(block, tmp_path):
    (tmp_path / "main.cpp").write_text(block.text)
    done = run(*compiler(), "-fsyntax-only", "-w", tmp_path / "main.cpp", env={**os.environ, "LC_ALL": "C"})
    assert done.returncode == 0, done.stderr[:4000]


def compiler():
    """How the build calls it for a program with all public headers."""
    commands = json.loads((BUILD / "compile_commands.json").read_text())
    command = next(each["command"] for each in commands if each["file"].endswith("examples/web_server/main.cpp"))
    words = [word for word in shlex.split(command) if not word.startswith(("-W", "-O"))]
    return words[:words.index("-o")]
