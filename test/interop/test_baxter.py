"""Baxter on Wheels (examples/baxter), as `rrgate demo baxter` starts it."""
import json
import os
import pathlib
import re
import subprocess
import sys

import pytest

from command_line import DEVICE_ERROR, Ran, run
from gateways import RRGATE
from processes import ROOT, Background

CLIENT = ROOT / "examples" / "baxter" / "client.py"
PATH = f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"  # of the Python that has the packages


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """Begins the URL of each service."""
    log = tmp_path_factory.mktemp("baxter") / "demo.log"
    process = Background([RRGATE, "demo", "baxter", "--port", "0", "--no-browser"], log, {"PATH": PATH})
    while not (page := re.search("http://127.0.0.1:[0-9]+/", process.next_line(60))):
        pass  # the device says where it listens
    yield process, f"{page[0]}devices/baxter?service="
    assert process.stop() == 0


def state_of_base(url):
    return json.loads(run("get", url + "base", "state", "--json"))


def drive_by_client(url):
    done = subprocess.run([sys.executable, CLIENT, url.replace("http", "rr+ws") + "base"], capture_output=True, text=True, timeout=60)
    return done, re.fullmatch(r"x (-?[\d.]+), wrist (-?[\d.]+), gripper (-?[\d.]+)\n", done.stdout)


def test_the_readmes_client_moves_arm_gripper_and_base(demo):
    _, url = demo
    begin = state_of_base(url)["x"]
    done, found = drive_by_client(url)
    assert found, done.stderr
    x, wrist, gripper = map(float, found.groups())
    assert 0.4 < x - begin < 0.7 and abs(wrist - 0.5) < 0.01 and gripper == 0


def test_the_base_keeps_its_limits_and_stops_where_nobody_tells_it(demo):
    process, url = demo
    Ran(["call", url + "base", "drive", "0.9", "0"]).refused(DEVICE_ERROR, "speed is 0.9, expected -0.8 to 0.8")
    begin = state_of_base(url)
    run("call", url + "base", "drive", "0.5", "0.2")
    process.wait_until(lambda: state_of_base(url)["speed"] == 0.5)
    process.wait_until(lambda: state_of_base(url)["speed"] == 0)
    end = state_of_base(url)
    assert 0.2 < end["x"] - begin["x"] < 0.35 and end["heading"] > begin["heading"]


def test_the_services_are_those_of_the_standard_types(demo):
    _, url = demo
    for service, type_name in (("right_arm", "robotics.robot.Robot"), ("right_gripper", "robotics.tool.Tool"), ("head_camera", "imaging.Camera")):
        assert f"com.robotraconteur.{type_name}" in run("info", url + service)
    picture = json.loads(run("call", url + "head_camera", "capture_frame_compressed", "--json"))
    assert picture["data"].startswith("iVBORw0KGgo")  # as PNG begins
