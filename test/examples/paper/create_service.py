"""A Robot Raconteur service for the iRobot Create: what Example 3 of the 2016 paper does (README.md).

    create_service.py [--serialport /dev/ttyUSB0] [--tcp-port 2354] [--nodename NAME] [--robotraconteur-...]
"""
import argparse
import pathlib
import struct
import sys
import threading
import time
import traceback

import numpy
import RobotRaconteur as RR
import serial

DEFINITION = pathlib.Path(__file__).parents[3] / "robdef" / "modern" / "experimental.create2.robdef"

# Commands of the robot's Open Interface.
START, FULL, DRIVE, SONG, PLAY, STREAM, PAUSE_STREAM = 128, 132, 137, 140, 141, 148, 150
STREAM_HEADER = 19
# Sensor packets: bumps and wheel drops, distance, angle, buttons.
BUMPS, DISTANCE, ANGLE, BUTTONS = 7, 19, 20, 18


class Create:
    """The object of the service. Its attributes of lower case, `packets` and `play_callback`, come from the node."""

    def __init__(self, port):
        self.Bump = RR.EventHook()
        self.DistanceTraveled = 0
        self.AngleTraveled = 0
        self.Bumpers = 0
        self._lock = threading.Lock()
        self._is_streaming = False
        self._listener = 0  # the client that is asked for songs: the one that started the stream
        self._play_is_pressed = False
        self._serial = serial.Serial(port=port, baudrate=57600, timeout=0.1)
        self._write(START, FULL, PAUSE_STREAM, 0)
        time.sleep(0.1)
        self._serial.reset_input_buffer()

    def close(self):
        self._is_streaming = False
        self._serial.close()

    # members

    def Drive(self, velocity, radius):
        self._write(*struct.pack(">Bhh", DRIVE, velocity, radius))

    def StartStreaming(self):
        if self._is_streaming:
            raise RR.InvalidOperationException("Already streaming")
        self._listener = RR.ServerEndpoint.GetCurrentEndpoint()
        self._is_streaming = True
        threading.Thread(target=self._receive, daemon=True).start()
        self._write(STREAM, 4, BUMPS, DISTANCE, ANGLE, BUTTONS)

    def StopStreaming(self):
        if not self._is_streaming:
            raise RR.InvalidOperationException("Not streaming")
        self._write(PAUSE_STREAM, 0)
        self._is_streaming = False

    # the serial line

    def _write(self, *command):
        with self._lock:
            self._serial.write(bytes(command))

    def _receive(self):
        while self._is_streaming:
            try:
                self._receive_packet()
            except Exception:  # a port that is closed meanwhile ends the thread, too
                if self._is_streaming:
                    traceback.print_exc()

    def _receive_packet(self):
        """Header, number of bytes, that many bytes, check sum: all of them together make 0."""
        if self._serial.read(1) != bytes([STREAM_HEADER]):
            return
        count = self._serial.read(1)
        packet = self._serial.read(count[0] + 1) if count else b""
        if not packet or (STREAM_HEADER + sum(count + packet)) % 256 != 0:
            return
        data = packet[:-1]
        self._send(data)
        self._take_in(data)

    def _send(self, data):
        packet = RR.RobotRaconteurNode.s.NewStructure("experimental.create2.SensorPacket")
        packet.ID = STREAM_HEADER
        packet.Data = numpy.frombuffer(data, dtype=numpy.uint8)
        self.packets.OutValue = packet

    def _take_in(self, data):
        at = 0
        while at < len(data):
            kind = data[at]
            if kind == BUMPS:
                was_free, self.Bumpers = self.Bumpers & 3 == 0, data[at + 1]
                if was_free and self.Bumpers & 3:
                    self.Bump.fire()
                at += 2
            elif kind == DISTANCE:
                self.DistanceTraveled += struct.unpack_from(">h", data, at + 1)[0]
                at += 3
            elif kind == ANGLE:
                self.AngleTraveled += struct.unpack_from(">h", data, at + 1)[0]
                at += 3
            elif kind == BUTTONS:
                was_pressed, self._play_is_pressed = self._play_is_pressed, data[at + 1] & 1 != 0
                if self._play_is_pressed and not was_pressed:
                    # The answer takes its time, and the robot does not wait.
                    threading.Thread(target=self._play, daemon=True).start()
                at += 2
            else:
                raise ValueError(f"sensor packet {kind}: expected {BUMPS}, {DISTANCE}, {ANGLE} or {BUTTONS}")

    def _play(self):
        try:
            ask = self.play_callback.GetClientFunction(self._listener)
            notes = [int(note) for note in ask(self.DistanceTraveled, self.AngleTraveled)]
            self._write(SONG, 0, len(notes) // 2, *notes, PLAY, 0)
        except Exception:  # a client that has no song, or is gone
            traceback.print_exc()


def main():
    parser = argparse.ArgumentParser(description="A Robot Raconteur service for the iRobot Create")
    parser.add_argument("--nodename", default="experimental.create2.Create")
    parser.add_argument("--serialport", default="/dev/ttyUSB0")
    parser.add_argument("--tcp-port", type=int, default=2354)
    options, node_options = parser.parse_known_args()

    create = Create(options.serialport)
    node = RR.RobotRaconteurNode.s
    with RR.ServerNodeSetup(options.nodename, options.tcp_port, argv=node_options):
        node.RegisterServiceType(DEFINITION.read_text(encoding="ascii"))
        node.RegisterService("Create", "experimental.create2.Create", create)
        print("Server started, press enter to quit...", flush=True)
        sys.stdin.readline()
        create.close()


if __name__ == "__main__":
    main()
