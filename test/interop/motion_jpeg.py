"""Streams of pictures as browsers get them."""
import http.client
import io

from PIL import Image


class Motion:
    """Parts of a multipart/x-mixed-replace stream."""

    def __init__(self, port, path, headers={}):
        self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
        self.connection.request("GET", path, headers=headers)
        self.response = self.connection.getresponse()
        assert self.response.headers["Content-Type"] == "multipart/x-mixed-replace; boundary=frame"
        assert self.response.readline() == b"--frame\r\n"

    def next(self):
        assert self.response.readline() == b"Content-Type: image/jpeg\r\n"
        size = int(self.response.readline().split(b": ")[1])
        assert self.response.readline() == b"\r\n"
        image = Image.open(io.BytesIO(self.response.read(size)))
        assert self.response.readline() + self.response.readline() == b"\r\n--frame\r\n"
        return image

    def close(self):
        self.response.close()
        self.connection.close()
