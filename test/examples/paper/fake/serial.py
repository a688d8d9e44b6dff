"""Stands in for pyserial and an iRobot Create behind it. The "port" is a file: each command that came is a line there.

The robot streams what it was asked for, in a fixed story: it stands; as soon as it is to drive, it covers 10 mm and turns
by -1 degree in each of 10 steps, runs against something with its right bumper, and somebody presses its play button.
"""
import struct
import threading

STEP = 0.015  # seconds between two packets, as on the robot
LENGTHS = {128: 1, 132: 1, 137: 5, 141: 2, 150: 2}  # commands of fixed length
STORY = [(0, 10, -1, 0)] * 10 + [(1, 0, 0, 0)] * 3 + [(0, 0, 0, 1)] * 3  # bumps, distance, angle, buttons


class Serial:
    def __init__(self, port, baudrate, timeout=None):
        assert baudrate == 57600
        self._log = open(port, "w", buffering=1, encoding="ascii")
        self._input = b""
        self._has_input = threading.Condition()
        self._timeout = timeout
        self._wanted = []  # the packets of the stream; empty: paused
        self._story = []
        self._closed = threading.Event()
        threading.Thread(target=self._run, daemon=True).start()

    def write(self, data):
        while data:
            length = command_length(data)
            command, data = data[:length], data[length:]
            self._log.write(f"{' '.join(map(str, command))}\n")
            if command[0] == 148:
                self._wanted = list(command[2:])
            elif command[0] == 150 and command[1] == 0:
                self._wanted = []
            elif command[0] == 137 and struct.unpack(">h", command[1:3])[0] != 0:
                self._story = list(STORY)

    def read(self, size=1):
        with self._has_input:
            self._has_input.wait_for(lambda: len(self._input) >= size, self._timeout)
            data, self._input = self._input[:size], self._input[size:]
            return data

    def reset_input_buffer(self):
        with self._has_input:
            self._input = b""

    def close(self):
        self._closed.set()

    def _run(self):
        while not self._closed.wait(STEP):
            if not self._wanted:
                continue
            bumps, distance, angle, buttons = self._story.pop(0) if self._story else (0, 0, 0, 0)
            values = {7: bytes([bumps]), 19: struct.pack(">h", distance), 20: struct.pack(">h", angle), 18: bytes([buttons])}
            data = b"".join(bytes([kind]) + values[kind] for kind in self._wanted)
            packet = bytes([19, len(data)]) + data
            with self._has_input:
                self._input += packet + bytes([-sum(packet) % 256])
                self._has_input.notify()


def command_length(data):
    if data[0] == 148:
        return 2 + data[1]
    if data[0] == 140:
        return 3 + 2 * data[2]
    return LENGTHS[data[0]]
