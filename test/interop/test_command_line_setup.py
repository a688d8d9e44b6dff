"""What rrgate makes and checks before a gateway starts: init and check-config."""
import getpass
import json
import os
import pathlib
import subprocess
import tempfile

import pytest

from command_line import DONE, FAILED, Ran, run
from gateways import RRGATE
from machine import need


def test_a_folder_that_init_could_not_finish_is_begun_anew(tmp_path):
    need("mount-namespaces")
    folder = tmp_path / "lab"
    folder.mkdir()
    file = folder / "gateway.json"
    file.write_text('{"listen": ["127.0.0.1:8080"], "devices": []}')
    script = 'mount --bind "$1" "$1" && shift && exec "$@"'  # the configuration, which comes last, can't be replaced
    failed = subprocess.run(["unshare", "-m", "--propagation", "private", "sh", "-c", script, "sh", file, RRGATE, "init", folder],
                            capture_output=True, text=True, timeout=60)
    assert failed.returncode == FAILED and failed.stderr == f"rrgate init: {file}: can't be written\n"
    assert list(folder.iterdir()) == [file]
    assert "user admin" in run("init", folder)
    assert {"gateway.json", "tls", "users", "tickets.key"} <= {each.name for each in folder.iterdir()}
    (folder / "gateway.json").unlink()
    assert Ran(["init", folder]).refused(FAILED, "is there already")
    assert (folder / "users").exists() and (folder / "tls").exists()  # what it did not make stays


@pytest.mark.parametrize("named", ["/etc/rrgate", "/etc/rrgate/", "."])
def test_init_knows_the_folder_of_the_service_however_it_is_named(tmp_path, named):
    need("mount-namespaces")
    (tmp_path / "rrgate").mkdir()
    script = 'mount --bind "$1" /etc && shift && cd /etc/rrgate && exec "$@"'
    made = subprocess.run(["unshare", "-m", "--propagation", "private", "sh", "-c", script, "sh", tmp_path, RRGATE, "init", named],
                          capture_output=True, text=True, timeout=60)
    assert made.returncode == DONE, made.stderr
    assert made.stdout.endswith("\nNext: put your devices into /etc/rrgate/gateway.json, then systemctl enable --now rrgate\n")
    config = json.loads((tmp_path / "rrgate/gateway.json").read_text())
    assert config["access"]["audit_file"] == "/var/log/rrgate/audit.jsonl"


def test_check_config_warns_of_tokens_that_the_service_cannot_write(tmp_path_factory):
    user = "nobody" if os.geteuid() == 0 else getpass.getuser()
    with tempfile.TemporaryDirectory() as name:  # below folders that everybody may enter
        folder = pathlib.Path(name)
        (folder / "gateway.json").write_text(json.dumps({"listen": ["127.0.0.1:1"], "devices": [], "access": {"tokens_file": "tokens"}}))
        (folder / "tokens").write_text("")
        folder.chmod(0o555)
        for each in folder.iterdir():
            each.chmod(0o644)
        ran = Ran(["check-config", folder / "gateway.json", "--as-service", user])
        assert ran.code == DONE and "good" in ran.out
        (warning,) = [line for line in ran.error.splitlines() if "can't write" in line]
        assert f"warning: user '{user}' can't write {folder}" in warning and "requests for access can't be approved" in warning
        folder.chmod(0o777)
        assert "can't write" not in Ran(["check-config", folder / "gateway.json", "--as-service", user]).error


def test_check_config_warns_of_recordings_that_the_service_cannot_write(tmp_path_factory):
    user = "nobody" if os.geteuid() == 0 else getpass.getuser()
    with tempfile.TemporaryDirectory() as name:  # below folders that everybody may enter
        folder = pathlib.Path(name)
        config = {"listen": ["127.0.0.1:1"], "devices": [], "recordings": {"folder": "runs/today"}}
        (folder / "gateway.json").write_text(json.dumps(config))
        (folder / "gateway.json").chmod(0o644)

        def warnings():
            ran = Ran(["check-config", folder / "gateway.json", "--as-service", user])
            assert ran.code == DONE and "good" in ran.out
            return [line for line in ran.error.splitlines() if "can't write" in line]

        def is_warned_of(where):
            (warning,) = warnings()
            return f"user '{user}' can't write {where}: " in warning and "nothing can be recorded" in warning

        folder.chmod(0o555)
        assert is_warned_of(folder)  # where it would be made
        folder.chmod(0o777)
        assert not warnings()
        (folder / "runs" / "today").mkdir(parents=True)
        (folder / "runs" / "today").chmod(0o555)
        assert is_warned_of(folder / "runs" / "today")
        (folder / "runs" / "today").chmod(0o777)
        assert not warnings()
