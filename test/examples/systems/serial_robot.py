"""An iRobot Create as a serial line shows it, on a terminal in the place of the line."""
import os
import pty
import select
import struct
import threading
import time
import tty

DEADLINE = 30  # seconds


def wait_for(is_so):
    until = time.monotonic() + DEADLINE
    while not is_so():
        assert time.monotonic() < until, "not within the deadline"
        time.sleep(0.05)


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
                self.commands.append(list(seen[:length]))
                seen = seen[length:]

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

    def heard(self, command):
        wait_for(lambda: command in self.commands)

    def unplug(self):
        if not self._is_plugged:
            return
        self._is_plugged = False
        self._reader.join()
        for end in (self._its_end, self.line):
            os.close(end)
