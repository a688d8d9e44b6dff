"""A Robot Raconteur node with an iRobot Create on a serial line, with the package RobotRaconteur of PyPI.

    create_serial.py DEVICE [PORT]      as /dev/ttyUSB0; 52222 without PORT, 0 for a free one

The serial line is used by the standard library alone.
"""
import os
import pathlib
import signal
import struct
import sys
import termios
import threading
import tty

import numpy
import RobotRaconteur as RR

DEFINITION = pathlib.Path(__file__).parents[2] / "robdef" / "modern" / "experimental.create2.robdef"

# Commands of the Open Interface.
START, FULL_MODE, DRIVE, SONG, PLAY, STREAM, PAUSE_STREAM = 128, 132, 137, 140, 141, 148, 150
STREAM_HEADER = 19
# What the stream is to hold: bumps and wheel drops, distance, angle, buttons. Numbers are big-endian.
BUMPS, DISTANCE, ANGLE, BUTTONS = 7, 19, 20, 18
SIZES = {BUMPS: 1, DISTANCE: 2, ANGLE: 2, BUTTONS: 1}
PACKET_BYTES = 10  # that these four are, each behind its number
STRAIGHT = 32767
MAX_NOTES = 16


def open_line(device):
    """57,600 baud, eight bits, no parity, no flow control."""
    line = os.open(device, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(line, termios.TCSANOW)
        mode = termios.tcgetattr(line)
        mode[4] = mode[5] = termios.B57600
        termios.tcsetattr(line, termios.TCSANOW, mode)
    except BaseException:
        os.close(line)
        raise
    return line


class StreamReader:
    """Cuts the stream at its packets: header, count, so many bytes, and a check sum that makes them all 0 modulo 256."""

    def __init__(self):
        self._bytes = b""

    def feed(self, data):
        """Yields the bytes between count and check sum of each whole packet. What is no packet is left out."""
        self._bytes += data
        while (begin := self._bytes.find(STREAM_HEADER)) >= 0:
            self._bytes = self._bytes[begin:]
            packet = self._bytes[:PACKET_BYTES + 3]
            if packet[1:2] in (b"", bytes([PACKET_BYTES])) and len(packet) < PACKET_BYTES + 3:
                return
            if packet[1] == PACKET_BYTES and sum(packet) % 256 == 0:
                self._bytes = self._bytes[len(packet):]
                yield packet[2:-1]
            else:
                self._bytes = self._bytes[1:]  # 19 that was something else, or bytes are missing
        self._bytes = b""


def read_sensors(packet):
    """{kind: value}, or None where the packet holds something else."""
    sensors = {}
    while packet:
        size = SIZES.get(packet[0])
        if size is None or len(packet) < 1 + size:
            return None
        sensors[packet[0]] = int.from_bytes(packet[1:1 + size], "big", signed=size == 2)
        packet = packet[1 + size:]
    return sensors


class Create:
    """The object of the service. Its attributes `packets` and `play_callback` come from the node."""

    def __init__(self, line, on_lost):
        self.Bump = RR.EventHook()
        self.DistanceTraveled = self.AngleTraveled = self.Bumpers = 0
        self._line, self._on_lost = line, on_lost
        self._lock = threading.Lock()  # calls, departures and the line come on threads of their own
        self._is_lost = False
        self._listeners = set()
        self._driver = 0  # who sent the last Drive and is still there
        self._is_play_pressed = False
        self._send(START, FULL_MODE, PAUSE_STREAM, 0)

    def follow(self, context):
        """To be called when the service is registered."""
        context.AddServerServiceListener(self._take_news)
        threading.Thread(target=self._read, daemon=True).start()

    def close(self):
        with self._lock:
            if self._driver and not self._is_lost:
                self._stop()

    # members

    def Drive(self, velocity, radius):
        if abs(velocity) > 500:
            raise RR.InvalidArgumentException(f"velocity {velocity} mm/s, expected -500 to 500")
        if abs(radius) > 2000 and radius not in (STRAIGHT, -32768):
            raise RR.InvalidArgumentException(f"radius {radius} mm, expected -2000 to 2000")
        with self._lock:
            self._send(*struct.pack(">Bhh", DRIVE, velocity, radius))
            self._driver = RR.ServerEndpoint.GetCurrentEndpoint() if velocity else 0

    def StartStreaming(self):
        with self._lock:
            if not self._listeners:
                self._send(STREAM, 4, BUMPS, DISTANCE, ANGLE, BUTTONS)
            self._listeners.add(RR.ServerEndpoint.GetCurrentEndpoint())

    def StopStreaming(self):
        with self._lock:
            self._leave_out(RR.ServerEndpoint.GetCurrentEndpoint())

    def _leave_out(self, client):
        if client in self._listeners:
            self._listeners.remove(client)
            if not self._listeners:
                self._send(PAUSE_STREAM, 0)

    def _stop(self):
        self._send(*struct.pack(">Bhh", DRIVE, 0, STRAIGHT))
        self._driver = 0

    def _take_news(self, _, event, client):
        if event != RR.ServerServiceListenerEventType_ClientDisconnected:
            return
        with self._lock:
            if self._is_lost:
                return
            self._leave_out(client)
            if client == self._driver:
                self._stop()  # a robot that nobody drives any more runs into things

    # the serial line

    def _send(self, *command):
        if self._is_lost:
            raise RR.OperationFailedException("the robot's serial line is gone")
        command = bytes(command)
        while command:
            command = command[os.write(self._line, command):]

    def _read(self):
        reader = StreamReader()
        try:
            while data := os.read(self._line, 512):
                for packet in reader.feed(data):
                    if sensors := read_sensors(packet):
                        self._take(packet, sensors)
            why = "end of file"
        except OSError as failure:
            why = failure.strerror
        self._is_lost = True
        self._on_lost(why)

    def _take(self, packet, sensors):
        self.DistanceTraveled += sensors.get(DISTANCE, 0)
        self.AngleTraveled += sensors.get(ANGLE, 0)
        was_free, self.Bumpers = self.Bumpers & 3 == 0, sensors.get(BUMPS, 0)
        was_pressed, self._is_play_pressed = self._is_play_pressed, sensors.get(BUTTONS, 0) & 1 != 0
        value = RR.RobotRaconteurNode.s.NewStructure("experimental.create2.SensorPacket")
        value.ID, value.Data = STREAM_HEADER, numpy.frombuffer(packet, dtype=numpy.uint8)
        self.packets.OutValue = value
        if was_free and self.Bumpers & 3:
            self.Bump.fire()
        if self._is_play_pressed and not was_pressed:
            threading.Thread(target=self._play, daemon=True).start()  # the answer takes its time, and the robot does not wait

    def _play(self):
        """Asks who drives for a song, or else who listens."""
        with self._lock:
            asked = self._driver or min(self._listeners, default=0)
        if not asked:
            return
        try:
            notes = self.play_callback.GetClientFunction(asked)(self.DistanceTraveled, self.AngleTraveled)
        except Exception as failure:  # of a client that knows no song, or is gone
            print(f"create_serial: no song: {failure}", file=sys.stderr)
            return
        count = min(len(notes) // 2, MAX_NOTES)
        with self._lock:
            self._send(SONG, 0, count, *map(int, notes[:2 * count]), PLAY, 0)


def main(device, port="52222", *options):
    try:
        line = open_line(device)
    except (OSError, termios.error) as failure:
        sys.exit(f"create_serial: {device}: {failure}")
    ended, lost = threading.Event(), []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())

    def on_lost(why):
        lost.append(f"create_serial: {device} is gone: {why}")
        ended.set()

    create = Create(line, on_lost)
    with RR.ServerNodeSetup("experimental.create2.Create", int(port), argv=["--robotraconteur-log-level=WARNING", *options]) as setup:
        node = RR.RobotRaconteurNode.s
        node.RegisterServiceType(DEFINITION.read_text(encoding="ascii"))
        create.follow(node.RegisterService("Create", "experimental.create2.Create", create))
        print(f"rr+tcp://127.0.0.1:{setup.tcp_transport.GetListenPort()}/?service=Create", flush=True)
        ended.wait()
        create.close()
    if lost:
        sys.exit(lost[0])


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        print("usage: create_serial.py DEVICE [PORT] [--robotraconteur-...]", file=sys.stderr)
        sys.exit(2)
    main(*sys.argv[1:])
