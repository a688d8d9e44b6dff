"""An iRobot Create as a serial line shows it, on a terminal in the place of the line.

    serial_robot.py                prints the terminal's name, for rrgate-create-serial or create_serial.py, and drives as it is told
    serial_robot.py --port PORT    starts rrgate-create-serial on it, which lies beside this file, for this machine alone
"""
import math
import os
import pathlib
import pty
import select
import signal
import struct
import subprocess
import sys
import threading
import time
import tty

STEP = 0.015  # seconds between two packets of the stream
ROOM = 2000  # mm from the middle, where the robot begins, to each wall
WHEEL_BASE = 258  # mm
STRAIGHT = (32767, -32768)


class Robot:
    """Notes the commands that come, and says what it is told to say."""

    LENGTHS = {128: 1, 132: 1, 137: 5, 141: 2, 150: 2}

    def __init__(self):
        self.line, its_end = pty.openpty()
        tty.setraw(its_end)
        self.device, self._its_end = os.ttyname(its_end), its_end
        self.commands = []
        self._is_plugged = True
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        seen = b""
        while self._is_plugged:
            if not select.select([self.line], [], [], 0.05)[0]:
                continue
            seen += os.read(self.line, 256)
            while seen and len(seen) >= (length := self._length(seen)):
                self.take(list(seen[:length]))
                seen = seen[length:]

    def take(self, command):
        self.commands.append(command)

    def _length(self, seen):
        if seen[0] in (140, 148):
            at = 2 if seen[0] == 140 else 1
            return 1 + at + (seen[at] * (2 if at == 2 else 1)) if len(seen) > at else at + 1
        return self.LENGTHS[seen[0]]

    def say(self, data):
        os.write(self.line, data)

    def packet(self, bumps=0, distance=0, angle=0, buttons=0):
        data = bytes([7, bumps, 19, *struct.pack(">h", distance), 20, *struct.pack(">h", angle), 18, buttons])
        packet = bytes([19, len(data)]) + data
        return packet + bytes([-sum(packet) % 256])

    def unplug(self):
        if not self._is_plugged:
            return
        self._is_plugged = False
        self._reader.join()
        for end in (self._its_end, self.line):
            os.close(end)


class DrivenRobot(Robot):
    """One that does what the commands say, in a square room whose walls it bumps into."""

    def __init__(self):
        self._velocity, self._radius, self._streams = 0, 0, False
        self._x = self._y = self._heading = 0.0  # mm, radians
        self._distance = self._angle = 0.0  # mm and degrees that no packet has told yet
        super().__init__()

    def take(self, command):
        if command[0] == 137:
            self._velocity, self._radius = struct.unpack(">hh", bytes(command[1:]))
        elif command[0] in (148, 150):
            self._streams = command[0] == 148 or command[1] == 1

    def run(self, is_over):
        while not is_over.wait(STEP):
            bumps = self._move()
            distance, angle = int(self._distance), int(self._angle)
            if self._streams:
                self._distance -= distance
                self._angle -= angle
                self.say(self.packet(bumps, distance, angle))

    def _move(self):
        """One step on. Returns which bumpers are pressed."""
        if self._radius in STRAIGHT:
            way, turn = self._velocity * STEP, 0.0
        elif self._radius in (1, -1):  # on the spot
            way, turn = 0.0, self._velocity * self._radius * STEP / (WHEEL_BASE / 2)
        else:
            way = self._velocity * STEP
            turn = way / self._radius if self._radius else 0.0
        self._heading += turn
        self._angle += math.degrees(turn)
        x, y = self._x + way * math.cos(self._heading), self._y + way * math.sin(self._heading)
        if max(abs(x), abs(y)) > ROOM:
            return 3
        self._x, self._y = x, y
        self._distance += way
        return 0


def main(port=None):
    is_over = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: is_over.set())
    robot = DrivenRobot()
    if port is None:
        print(robot.device, flush=True)
        return robot.run(is_over)
    threading.Thread(target=robot.run, args=(is_over,), daemon=True).start()
    program = pathlib.Path(__file__).with_name("rrgate-create-serial")
    with subprocess.Popen([program, robot.device, f"127.0.0.1:{port}"]) as service:
        while service.poll() is None and not is_over.wait(0.1):
            pass
        service.terminate()
    return 0 if is_over.is_set() else service.returncode


if __name__ == "__main__":
    if len(sys.argv) not in (1, 3) or sys.argv[1:2] not in ([], ["--port"]):
        print("usage: serial_robot.py [--port PORT]", file=sys.stderr)
        sys.exit(2)
    sys.exit(main(*sys.argv[2:]))
