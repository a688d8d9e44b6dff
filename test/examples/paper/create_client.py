"""A Robot Raconteur client for the iRobot Create: what Example 4 of the 2016 paper does (README.md).

    create_client.py [URL] [--drive SECONDS] [--rest SECONDS]      Ctrl-C ends the rest
"""
import argparse
import sys
import time

import numpy
from RobotRaconteur.Client import RRN


def say(text):
    """One write a line: values, events and callbacks come on threads of their own."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def bumped():
    say("Bump!!")


def wire_changed(connection, value, when):
    say(" ".join(map(str, value.Data)))


def play_callback(distance, angle):
    """A song of three notes: each its number and its duration in 1/64 s."""
    say(f"Play after {distance} mm and {angle} degrees")
    return numpy.array([69, 16, 60, 16, 69, 16], dtype=numpy.uint8)


def main():
    parser = argparse.ArgumentParser(description="A Robot Raconteur client for the iRobot Create")
    parser.add_argument("url", nargs="?", default="rr+tcp://localhost:2354?service=Create")
    parser.add_argument("--drive", type=float, default=5, help="seconds on the arc")
    parser.add_argument("--rest", type=float, default=10, help="seconds to listen after it")
    options = parser.parse_args()

    create = RRN.ConnectService(options.url)
    create.StartStreaming()
    create.Bump += bumped
    wire = create.packets.Connect()
    wire.WireValueChanged += wire_changed
    create.play_callback.Function = play_callback

    create.Drive(100, 1000)
    say("Driving")
    time.sleep(options.drive)
    create.Drive(0, 1000)
    try:
        say(f"Stopped after {create.DistanceTraveled} mm")
        time.sleep(options.rest)
    except KeyboardInterrupt:
        pass
    create.StopStreaming()


if __name__ == "__main__":
    main()
