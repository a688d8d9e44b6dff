"""Images of devices as browsers show them: PNG, JPEG, one after another as MJPEG; sizes that lie are refused."""
import base64
import io
import json
import os
import struct
import subprocess
import sys
import threading
import time

import pytest
from PIL import Image

from directions import PEERS
from http_api import ask
from motion_jpeg import Motion
from processes import Background, start_gateway

BASE = "/api/v1/devices/interop/camera"
PNG, JPEG = "image/png", "image/jpeg"


@pytest.fixture(scope="module")
def gateway(tmp_path_factory):
    folder = tmp_path_factory.mktemp("images")
    device = Background([sys.executable, PEERS / "images.py"], folder / "device.log")
    process, port = start_gateway(folder, json.loads(device.next_line())["url"])
    yield port
    assert process.stop() == 0, process.description()
    device.stop()


def frame(width, height, encoding, data):
    return {"width": width, "height": height, "format": encoding, "data": base64.b64encode(data).decode()}


def put(port, width, height, encoding, data):
    assert ask(port, "PUT", "/still", frame(width, height, encoding, data), base=BASE).status == 204


def get(port, path="/still", accept=None):
    return ask(port, "GET", path, headers={"Accept": accept} if accept else {}, base=BASE)


def gradient(width, height, channels):
    return bytes((x * 7 + y * 3 + channel * 50) % 256 for y in range(height) for x in range(width) for channel in range(channels))


@pytest.mark.parametrize("encoding, channels, mode, raw", [
    ("mono8", 1, "L", "L"), ("rgb8", 3, "RGB", "RGB"), ("bgr8", 3, "RGB", "BGR"), ("RGBA_8888", 4, "RGBA", "RGBA"),
    ("bgra8", 4, "RGBA", "BGRA")])
def test_every_pixel_is_in_the_png(gateway, encoding, channels, mode, raw):
    data = gradient(37, 11, channels)
    put(gateway, 37, 11, encoding, data)
    answer = get(gateway, accept=PNG)
    assert (answer.status, answer.headers["Content-Type"]) == (200, PNG), answer.body
    image = Image.open(io.BytesIO(answer.body))
    assert (image.size, image.mode) == ((37, 11), mode)
    assert image.tobytes() == Image.frombytes(mode, (37, 11), data, "raw", raw).tobytes()


def test_sixteen_bits(gateway):
    values = [(x * 977) % 65536 for x in range(20 * 10)]
    put(gateway, 20, 10, "mono16", struct.pack("<200H", *values))
    image = Image.open(io.BytesIO(get(gateway, "/still?as=png").body))
    assert image.size == (20, 10) and list(image.get_flattened_data()) == values
    jpeg = Image.open(io.BytesIO(get(gateway, "/still?as=jpeg").body))
    assert (jpeg.size, jpeg.mode) == ((20, 10), "L")


@pytest.mark.parametrize("encoding, channels, raw", [("rgb8", 3, "RGB"), ("bgra8", 4, "BGRA")])
def test_a_jpeg_looks_like_it(gateway, encoding, channels, raw):
    color = (200, 100, 50)
    pixels = Image.new("RGB", (32, 16), color).tobytes()
    if raw == "BGRA":
        pixels = bytes(byte for at in range(0, len(pixels), 3) for byte in (*pixels[at:at + 3][::-1], 255))
    put(gateway, 32, 16, encoding, pixels)
    answer = get(gateway, accept=JPEG)
    assert answer.headers["Content-Type"] == JPEG
    image = Image.open(io.BytesIO(answer.body))
    assert image.size == (32, 16)
    assert all(abs(is_ - was) < 6 for is_, was in zip(image.getpixel((7, 7)), color))


def test_what_is_compressed_passes_as_it_is(gateway):
    made = io.BytesIO()
    Image.new("RGB", (8, 8), (1, 2, 3)).save(made, "JPEG")
    photo = {"image_info": {"width": 8, "height": 8, "step": 0, "encoding": "compressed"},
             "data": base64.b64encode(made.getvalue()).decode()}
    assert ask(gateway, "PUT", "/photo", photo, base=BASE).status == 204
    assert get(gateway, "/photo", JPEG).body == made.getvalue()
    refused = get(gateway, "/photo?as=png")
    assert (refused.status, refused.json["detail"]) == (422, "the image is image/jpeg; ask for that")
    assert get(gateway, "/photo").json == photo


def test_rows_may_be_longer_than_their_pixels(gateway):
    rows = [gradient(5, 1, 3) + b"\xee" for _ in range(4)]
    photo = {"image_info": {"width": 5, "height": 4, "step": 16, "encoding": "bgr888"},
             "data": base64.b64encode(b"".join(rows)).decode()}
    assert ask(gateway, "PUT", "/photo", photo, base=BASE).status == 204
    image = Image.open(io.BytesIO(get(gateway, "/photo", "image/avif,image/*,*/*;q=0.8").body))
    assert image.tobytes() == Image.frombytes("RGB", (5, 4), b"".join(row[:15] for row in rows), "raw", "BGR").tobytes()


@pytest.mark.parametrize("accept, kind", [
    ("image/png;q=0, image/jpeg", JPEG), ("image/png;q=0, image/*", JPEG), ("image/*, image/jpeg;q=0", PNG), ("image/JPEG", JPEG), ("image/png-x, image/jpeg", JPEG),
    ("image/*;q=0, application/json", "application/json")])
def test_an_image_is_of_an_accepted_type(gateway, accept, kind):
    put(gateway, 2, 2, "mono8", bytes(4))
    assert get(gateway, accept=accept).headers["Content-Type"] == kind


def test_functions_and_wires(gateway):
    answer = ask(gateway, "POST", "/capture", {"width": 16, "height": 4}, headers={"Accept": PNG}, base=BASE)
    assert Image.open(io.BytesIO(answer.body)).tobytes() == bytes(range(64))
    assert ask(gateway, "POST", "/show", {"frame": frame(2, 2, "mono8", b"\1\2\3\4")}, base=BASE).status == 200
    assert Image.open(io.BytesIO(get(gateway, "/live?as=png").body)).tobytes() == b"\1\2\3\4"


@pytest.mark.parametrize("width, height, encoding, size, detail", [
    (0xFFFFFFFF, 0xFFFFFFFF, "rgb8", 12, "pixels, expected 1 to 16384"), (65536, 65536, "mono8", 0, "pixels, expected"),
    (16384, 16384, "mono8", 4, "pixels, expected"), (0, 5, "mono8", 5, "0 x 5 pixels"), (4, 4, "rgb8", 47, "47 bytes, too few"),
    (4, 4, "rgb8", 0, "0 bytes, too few"), (2, 2, "rgb8", 16, "16 bytes, too many"), (2, 2, "mono8", 400, "400 bytes, too many"),
    (20, 10, "", 300, "300 bytes, too many"), (10, 10, "yuv422", 200, "is encoded as 'yuv422'"),
    (4, 4, "", 35, "does not say how"), (0, 0, "", 0, "does not say how"), (2**31, 2**31, "", 3, "does not say how")])
def test_sizes_that_lie(gateway, width, height, encoding, size, detail):
    put(gateway, width, height, encoding, bytes(size))
    for kind in ("png", "jpeg"):
        answer = get(gateway, "/still?as=" + kind)
        assert answer.status == 422 and detail in answer.json["detail"], answer.body
    assert get(gateway).json["width"] == width


def test_what_is_no_image_stays_json(gateway):
    assert ask(gateway, "PUT", "/other", {"width": 1, "data": "x"}, base=BASE).status == 204
    assert get(gateway, "/other", PNG).json == {"width": 1, "data": "x"}
    document = ask(gateway, "GET", "/openapi.json", base="/api/v1/devices/interop").json["paths"]
    assert PNG in document[BASE + "/still"]["get"]["responses"]["200"]["content"]
    assert PNG not in document[BASE + "/other"]["get"]["responses"]["200"]["content"]
    assert "multipart/x-mixed-replace" in document[BASE + "/frames"]["get"]["responses"]["200"]["content"]


def test_without_a_word_for_it_three_bytes_are_blue_green_red(gateway):
    put(gateway, 4, 2, "", gradient(4, 2, 3))
    image = Image.open(io.BytesIO(get(gateway, accept=PNG).body))
    assert image.tobytes() == Image.frombytes("RGB", (4, 2), gradient(4, 2, 3), "raw", "BGR").tobytes()


def is_of(picture, shade):
    return picture.size == (64, 48) and abs(picture.getpixel((20, 20)) - shade) <= 2


@pytest.mark.parametrize("path, headers", [("/frames?as=mjpeg", {}), ("/live", {"Accept": "multipart/x-mixed-replace"})])
def test_frames_as_they_come(gateway, path, headers):
    motion = Motion(gateway, BASE + path, headers)
    for shade in (50, 150, 250):
        assert ask(gateway, "POST", "/show", {"frame": frame(64, 48, "mono8", bytes([shade]) * 3072)}, base=BASE).status == 200
        while not is_of(motion.next(), shade):
            pass  # a wire's value of before
        # One that lies is left out.
        ask(gateway, "POST", "/show", {"frame": frame(64, 48, "mono8", b"")}, base=BASE)
    motion.close()


def test_a_slow_viewer_gets_the_newest(gateway):
    motion = Motion(gateway, BASE + "/frames?as=mjpeg")
    noise = os.urandom(1000 * 1000)
    for _ in range(60):  # as JPEG far more than sockets hold
        ask(gateway, "POST", "/show", {"frame": frame(1000, 1000, "mono8", noise)}, base=BASE)
    ask(gateway, "POST", "/show", {"frame": frame(16, 16, "mono8", bytes(256))}, base=BASE)
    seen = 1
    while motion.next().size != (16, 16):
        seen += 1
    assert seen < 60
    motion.close()


def test_a_slow_viewer_gets_the_last_one_before_the_end(gateway):
    motion = Motion(gateway, BASE + "/clip?as=mjpeg")
    noise = os.urandom(1000 * 1000)
    for _ in range(60):
        ask(gateway, "POST", "/show", {"frame": frame(1000, 1000, "mono8", noise)}, base=BASE)
    ask(gateway, "POST", "/show_last", {"frame": frame(16, 16, "mono8", bytes(256))}, base=BASE)
    while motion.next().size != (16, 16):
        pass
    assert motion.response.read() == b""
    motion.close()


def test_what_takes_long_keeps_nobody_waiting(gateway):
    """Twelve million pixels, which take a second or so to pack."""
    put(gateway, 4000, 3000, "mono8", os.urandom(4000) * 3000)
    image = threading.Thread(target=get, args=(gateway, "/still", PNG))
    begin = time.monotonic()
    image.start()
    longest = 0
    while image.is_alive():
        asked = time.monotonic()
        assert ask(gateway, "GET", "/healthz").status == 200
        longest = max(longest, time.monotonic() - asked)
    took = time.monotonic() - begin
    assert longest < took / 2, (longest, took)


def test_a_browser_shows_it(gateway):
    """Chromium's own page for a picture says how large it is."""
    put(gateway, 33, 22, "rgb8", gradient(33, 22, 3))
    for kind in ("png", "jpeg"):
        run = subprocess.run(
            [os.environ.get("CHROMIUM", "/usr/bin/chromium"), "--headless", "--no-sandbox", "--disable-gpu",
             "--no-first-run", "--disable-background-networking", "--disable-component-update", "--dump-dom",
             f"http://127.0.0.1:{gateway}{BASE}/still?as={kind}"], capture_output=True, text=True, timeout=60)
        assert "(33×22)" in run.stdout, run.stdout + run.stderr[-1000:]
