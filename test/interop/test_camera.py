"""The camera driver of PyPI behind the gateway: its pictures as browsers show them, its settings, and what version 0.2.0 lacks."""
import io
import json
import sys

import pytest
from PIL import Image

from directions import PEERS
from http_api import ask
from motion_jpeg import Motion
from processes import Background, free_port, start_gateway

BASE = "/api/v1/devices/interop/camera"
SIZE = (64, 48)
BRIGHTNESS = 200  # which is the blue of the film
READY, STREAMING = 1, 2


@pytest.fixture(scope="module")
def camera(tmp_path_factory):
    """The port of a gateway to it."""
    folder = tmp_path_factory.mktemp("camera")
    port = free_port()
    driver = Background([sys.executable, PEERS / "camera.py", port], folder / "camera.log")
    driver.next_line()
    gateway, http = start_gateway(folder, f"rr+tcp://127.0.0.1:{port}/?service=camera")
    yield http
    assert gateway.stop() == 0, gateway.description()
    driver.stop()


def call(port, function, arguments={}, status=200, **headers):
    answer = ask(port, "POST", "/" + function, arguments, headers=headers, base=BASE)
    assert answer.status == status, answer.body
    return answer


def get(port, member, status=200):
    answer = ask(port, "GET", "/" + member, base=BASE)
    assert answer.status == status, answer.body
    return answer.json


def setting(port, name):
    return call(port, "getf_param", {"param_name": name}).json["result"]


def change(port, name, value):
    call(port, "setf_param", {"param_name": name, "value": of_double(value)})


def of_double(value):
    return {"type": "double[]", "value": [value]}


def is_film(picture, blue=BRIGHTNESS):
    return picture.size == SIZE and all(abs(is_ - was) < 6 for is_, was in zip(picture.getpixel((7, 7)), (50, 100, blue)))


def test_a_still_is_what_the_camera_sees(camera):
    still = Image.open(io.BytesIO(call(camera, "capture_frame", Accept="image/png").body))
    assert still.tobytes() == Image.new("RGB", SIZE, (50, 100, BRIGHTNESS)).tobytes()
    compressed = call(camera, "capture_frame_compressed", Accept="image/jpeg")
    assert compressed.headers["Content-Type"] == "image/jpeg" and is_film(Image.open(io.BytesIO(compressed.body)))


def test_streams_show_a_setting_as_soon_as_it_is_changed(camera):
    call(camera, "start_streaming")
    try:
        for stream in ("frame_stream", "frame_stream_compressed", "preview_stream"):
            motion = Motion(camera, f"{BASE}/{stream}?as=mjpeg")
            assert is_film(motion.next())
            change(camera, "brightness", 20)
            while is_film(motion.next()):
                pass  # one of before
            assert is_film(motion.next(), 20)
            change(camera, "brightness", BRIGHTNESS)
            while is_film(motion.next(), 20):
                pass
            motion.close()
        while get(camera, "camera_state")["state_flags"] != READY | STREAMING:
            pass  # it says so twenty times a second
    finally:
        call(camera, "stop_streaming")
    assert "Not streaming" in call(camera, "stop_streaming", status=409).json["detail"]


def test_settings_are_listed_and_read(camera):
    settings = [each["parameter_identifier"]["name"] for each in get(camera, "param_info")]
    assert settings == ["focus", "exposure", "gain", "brightness", "contrast", "saturation"]
    assert setting(camera, "brightness") == of_double(BRIGHTNESS)
    change(camera, "gain", 2.5)
    assert setting(camera, "gain") == of_double(2.5)
    assert "Parameter not found" in call(camera, "getf_param", {"param_name": "colour"}, 409).json["detail"]


def test_what_the_file_says_of_the_camera(camera):
    info = get(camera, "camera_info")
    assert info["device_info"]["device"]["name"] == "film" and info["device_info"]["serial_number"] == "987"
    calibration = info["calibration"]
    assert calibration["K"] == {"dims": [3, 3], "data": [70, 0, 0, 0, 70, 0, 32, 24, 1]}
    assert json.dumps(calibration["distortion_info"]).count("0.25") == 1


def test_what_it_lacks_is_said(camera):
    assert get(camera, "isoch_info") is None
    assert "trigger_mode" in get(camera, "trigger_mode", 502)["detail"]
    assert "Not available on this device" in call(camera, "trigger", status=501).json["detail"]
