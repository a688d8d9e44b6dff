"""Each key of the configuration is named by a test of what it does, beside those of how the file is read."""
import json
import re

from pages import ROOT
from test_security import names_of_tests

SCHEMA = ROOT / "gateway-config" / "gateway.schema.json"
KINDS = (".py", ".ts", ".mjs", ".cpp", ".hpp")
FOLDERS = {"node_modules", "__pycache__", "docs", "fuzz", "golden"}
READING = {"config_test.cpp"}  # whether the file is read right, whatever is done with it then
OF_EDITORS = {"$schema"}

# What tests of C++ set in a Config, which is held to the key by config_test.cpp: the name of one.
NATIVE = {
    "access.jwt.roles_claim": "JWT: where user and roles are",
    "access.jwt.secret_file": "tokens are checked with the secret of a file, and with its next one when that has changed",
    "access.jwt.user_claim": "JWT: where user and roles are",
    "audit.fsync": "with fsync each batch is on the disk before it counts as written, and what can't get there is not",
    "devices.shares_reads": "clients of a shared device that read a property at once are one read to it, where that is wanted",
    "discover.max_devices": "a flood of nodes is bounded; those that are known stay",
    "limits.body_bytes": "a body may have as many bytes as are allowed and not one more",
    "limits.max_message_size": "a message above the limit closes that connection alone",
    "limits.outbox_bytes": "while one side takes nothing, the relay takes no more from the other than it may hold",
    "timeouts.idle_ms": "silent, half-open and idle connections are closed",
    "timeouts.request_ms": "a device that takes too long has the time for its answer that the configuration gives it",
}


def keys_of(schema, above=""):
    """"limits", "limits.memory": where lists and maps are on the way, what they hold."""
    found = []
    for name, below in schema.get("properties", {}).items():
        found += [above + name, *keys_of(below, f"{above}{name}.")]
    for inner in [schema.get("items"), schema.get("additionalProperties"), *schema.get("oneOf", []), *schema.get("anyOf", [])]:
        if isinstance(inner, dict):
            found += keys_of(inner, above)
    return found


def names(text, key):
    """Whether the text has the key as a word of JSON, or as a keyword of Python's calls."""
    return re.search(rf"""["'\\]{re.escape(key)}\\?["']|\b{re.escape(key)}=(?!=)""", text) is not None


def texts_of_tests():
    return [file.read_text() for file in sorted((ROOT / "test").rglob("*"))
            if file.suffix in KINDS and file.name not in READING and not FOLDERS & set(file.relative_to(ROOT).parts)]


def unnamed(keys, texts):
    """The keys that no text has together with the key that they are below."""
    return [key for key in keys if not any(all(names(text, part) for part in key.split(".")[-2:]) for text in texts)]


def test_each_key_is_named_by_a_test_of_what_it_does():
    keys = dict.fromkeys(keys_of(json.loads(SCHEMA.read_text())))
    assert len(keys) > 100
    assert [key for key in unnamed(keys, texts_of_tests()) if key not in NATIVE and key not in OF_EDITORS] == []


def test_the_tests_of_cpp_are_there_and_the_keys_too():
    there = names_of_tests()
    assert [(key, name) for key, name in NATIVE.items() if name not in there] == []
    assert NATIVE.keys() - set(keys_of(json.loads(SCHEMA.read_text()))) == set()


def test_a_key_is_named_where_the_one_above_it_is():
    texts = ['{"limits": {"memory": 1}}', "Gateway(rates=dict(user=2))", r'R"({\"tls\": {\"ca\": []}})"', "if clients == 3:"]
    keys = ["limits", "limits.memory", "limits.clients", "rates.user", "tls.ca", "recordings.memory", "clients"]
    assert unnamed(keys, texts) == ["limits.clients", "recordings.memory", "clients"]
