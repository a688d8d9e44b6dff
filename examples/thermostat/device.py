# The same thermostat in Python, with the RobotRaconteur package.
import sys
import time
from pathlib import Path

import RobotRaconteur as RR

RRN = RR.RobotRaconteurNode.s
DEFINITION = Path(__file__).with_name("example.thermostat.robdef")


class Room:
    def __init__(self):
        self.reached = RR.EventHook()
        self.celsius = 17.0
        self._target = 17.0

    @property
    def target(self):
        return self._target

    @target.setter
    def target(self, value):
        if value > 30:
            raise RRN.GetExceptionType("example.thermostat.TooHot")(f"target {value}, expected at most 30")
        self._target = value
        if self.celsius >= value:
            self.reached.fire(self.celsius)

    def cool(self, degrees):
        self.celsius -= degrees

    def step(self):
        heating = self.celsius < self._target
        if heating:
            self.celsius += 0.5
            if self.celsius >= self._target:
                self.reached.fire(self.celsius)
        reading = RRN.NewStructure("example.thermostat.Reading")
        reading.celsius, reading.heating = self.celsius, heating
        self.reading.OutValue = reading


port = int(sys.argv[1]) if len(sys.argv) > 1 else 52230
with RR.ServerNodeSetup("example.room", port):
    RRN.RegisterServiceType(DEFINITION.read_text())
    room = Room()
    RRN.RegisterService("Thermostat", "example.thermostat.Thermostat", room)
    print(f"rr+tcp://127.0.0.1:{port}/?service=Thermostat", flush=True)
    while True:
        room.step()
        time.sleep(0.01)
