"""Twelve colour sensors as small as those on microcontrollers: message version 4, no string table, one connection at a time.

small_sensors.py        prints their ports as a JSON array; runs until its standard input ends

Each is a node of the real package behind a port that takes the next connection when the last one has gone. Every second one
writes sizes at full length.
"""
import json
import select
import socket
import sys
import threading

import RobotRaconteur as RR

import quiet_node
from long_sizes import Lengthened

COUNT = 12
DEFINITION = """service experimental.small_sensor
object Sensor
    property double[3] reading [readonly]
    wire double[3] readings [readonly]
end
"""
OPTIONS = {**quiet_node.QUIET, **quiet_node.QUIET_SERVER, "disable-message4": "false", "disable-stringtable": "true"}


class Sensor:
    def __init__(self, number):
        self.reading = [number, 100.0, 0.5]


class OnlyOne:
    """A port in front of another one, with one connection at a time: further ones wait until it has gone."""

    def __init__(self, port, has_long_sizes):
        self._port = port
        self._has_long_sizes = has_long_sizes
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        while True:
            self._pass_on(self._listener.accept()[0])

    def _pass_on(self, client):
        try:
            with client, socket.create_connection(("127.0.0.1", self._port)) as device:
                other = {client: device, device: client}
                lengthened = Lengthened()
                while True:
                    for end in select.select(list(other), [], [])[0]:
                        data = end.recv(65536)
                        if not data:
                            return
                        other[end].sendall(lengthened(data) if end is device and self._has_long_sizes else data)
        except OSError:
            pass  # one of them is gone


def main():
    arguments = [f"--robotraconteur-{name}={value}" for name, value in OPTIONS.items()]
    running, ports = [], []
    for number in range(COUNT):
        node = RR.RobotRaconteurNode()
        node.Init()
        setup = RR.ServerNodeSetup(f"small.sensor.{number}", 0, argv=arguments, node=node)
        sensor = Sensor(number)
        node.RegisterServiceType(DEFINITION)
        node.RegisterService("Sensor", "experimental.small_sensor.Sensor", sensor)
        running.append((setup, node, sensor))
        ports.append(OnlyOne(setup.tcp_transport.GetListenPort(), number % 2 == 1).port)
    stopped = threading.Event()

    def publish():
        while not stopped.wait(0.1):
            for _, _, sensor in running:
                sensor.readings.OutValue = sensor.reading

    publisher = threading.Thread(target=publish)
    publisher.start()
    print(json.dumps(ports), flush=True)
    sys.stdin.read()
    stopped.set()
    publisher.join()
    for setup, node, _ in running:
        setup.close()
        node.Shutdown()


if __name__ == "__main__":
    main()
