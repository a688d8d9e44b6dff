"""A device with images (experimental.images), by the reference implementation; ready and ended as service.py is."""
import json
import pathlib
import sys

import numpy
import RobotRaconteur as RR

import quiet_node

DEFINITION = pathlib.Path(__file__).parent.parent / "experimental.images.robdef"


class Camera:
    photo = still = other = None

    def __init__(self):
        self.viewers = []

    @property
    def clip(self):
        return self._clip

    @clip.setter
    def clip(self, pipe):
        self._clip = pipe
        pipe.PipeConnectCallback = self.viewers.append

    def capture(self, width, height):
        frame = RR.RobotRaconteurNode.s.NewStructure("experimental.images.Frame")
        frame.width, frame.height, frame.format = width, height, "mono8"
        frame.data = numpy.arange(width * height, dtype=numpy.uint8)
        return frame

    def show(self, frame):
        self.live.OutValue = frame
        self.frames.AsyncSendPacket(frame, lambda *_: None)
        for viewer in self.viewers:
            viewer.SendPacket(frame)

    def show_last(self, frame):
        """The clip ends with it."""
        while self.viewers:
            viewer = self.viewers.pop()
            viewer.SendPacket(frame)
            viewer.Close()


def main():
    node = RR.RobotRaconteurNode.s
    with RR.ServerNodeSetup("images", 0, argv=quiet_node.arguments(server=True)) as setup:
        node.RegisterServiceType(DEFINITION.read_text(encoding="ascii"))
        node.RegisterService("camera", "experimental.images.Camera", Camera())
        port = setup.tcp_transport.GetListenPort()
        print(json.dumps({"port": port, "url": f"rr+tcp://127.0.0.1:{port}/?service=camera"}), flush=True)
        sys.stdin.buffer.read()


if __name__ == "__main__":
    main()
