"""Who may do what: the files of users and tokens."""
import subprocess

from processes import BUILD

RRGATE = BUILD / "server" / "rrgate"


def rrgate(*arguments, given=""):
    done = subprocess.run([RRGATE, *map(str, arguments)], input=given, capture_output=True, text=True, timeout=30)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_passwd_and_token(tmp_path):
    users, tokens = tmp_path / "secret" / "users", tmp_path / "secret" / "tokens"
    assert "added" in rrgate("passwd", users, "alice", "--roles", "a,b", given="one\n")
    assert users.stat().st_mode & 0o777 == 0o600 and users.parent.stat().st_mode & 0o777 == 0o700
    first = users.read_text()
    assert first.startswith("alice $scrypt$ln=") and first.endswith(" a,b\n")
    rrgate("passwd", users, "bob", given="two\n")
    assert "changed" in rrgate("passwd", users, "alice", given="three\n")
    alice, bob = users.read_text().splitlines()
    assert alice.endswith(" a,b") and not first.startswith(alice) and bob.startswith("bob ") and bob.endswith(" _")
    assert "deleted" in rrgate("passwd", users, "alice", "--delete")
    assert users.read_text() == bob + "\n"
    token = rrgate("token", tokens, "ci", "--roles", "a", "--days", 1)
    assert token.startswith("rrg_") and token not in tokens.read_text()
    rrgate("token", tokens, "ci", "--delete")
    assert tokens.read_text() == ""
    for arguments, given in [(["passwd", users, "alice"], "\n"), (["passwd", users, "alice"], ""), (["passwd", users, "a:b"], "x\n"),
                             (["passwd", users, "alice", "--delete"], ""), (["passwd", users, "alice", "--roles", "a b"], "x\n"),
                             (["token", tokens, "ci", "--delete"], ""), (["token", tokens, "x", "--days", "0"], ""),
                             (["passwd", tmp_path, "alice"], "x\n"), (["passwd", users], "")]:
        done = subprocess.run([RRGATE, *map(str, arguments)], input=given, capture_output=True, text=True, timeout=30)
        assert done.returncode in (1, 2) and done.stderr.startswith("rrgate "), (arguments, done)
    assert users.read_text() == bob + "\n"
