"""Drives an iRobot Create for a second, and prints what its sensors say, with the package RobotRaconteur of PyPI.

    client.py URL      Ctrl-C ends the drive
"""
import sys
import time

import RobotRaconteur as RR

SPEED = 100  # mm/s
STRAIGHT = 32767  # a radius that stands for none


def drive(create, packets):
    create.Drive(SPEED, STRAIGHT)
    for _ in range(5):
        time.sleep(0.2)
        is_there, packet, _ = packets.TryGetInValue()
        if is_there:
            print(f"packet {packet.ID}:", *packet.Data, flush=True)


def main(url):
    with RR.ClientNodeSetup(argv=["--robotraconteur-log-level=WARNING"]):
        create = RR.RobotRaconteurNode.s.ConnectService(url)
        print(f"DistanceTraveled: {create.DistanceTraveled} mm", flush=True)
        create.Bump += lambda: print("bump", flush=True)
        packets = create.packets.Connect()
        create.StartStreaming()
        try:
            drive(create, packets)
        except KeyboardInterrupt:
            pass  # the drive is over, and ends as always
        finally:
            create.Drive(0, STRAIGHT)
            create.StopStreaming()
        print(f"DistanceTraveled: {create.DistanceTraveled} mm", flush=True)


main(sys.argv[1])
