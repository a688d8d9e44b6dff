"""A laser scanner of the standard types in the middle of a room of 4 m by 4 m, by the reference implementation.

    laser_scanner.py PORT
"""
import sys
import threading

import numpy as np
import quiet_node
import RobotRaconteur as RR
import RobotRaconteurCompanion as RRC

TYPE = "com.robotraconteur.laserscanner.LaserScanner"
SCAN = "com.robotraconteur.laserscan.LaserScan%sf"  # which the type calls LaserScan
COUNT = 360


def scan(node):
    angles = -np.pi + np.arange(COUNT) * 2 * np.pi / COUNT
    out = node.NewStructure(SCAN % "")
    out.scan_info = node.NewStructure(SCAN % "Info")
    out.scan_info.angle_min, out.scan_info.angle_max = angles[0], angles[-1]
    out.scan_info.angle_increment, out.scan_info.angle_count = angles[1] - angles[0], COUNT
    out.scan_info.range_min, out.scan_info.range_max = 0.1, 10
    out.ranges = np.float32(2 / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles))))
    out.ranges[:10] = 100  # a window
    return out


class Scanner:
    def RRServiceObjectInit(self, context, path):
        self.packets = self.laser_scan_sensor_data
        self.packets.MaxBacklog = 3


def main(port):
    with RR.ServerNodeSetup("test.laser_scanner", port, argv=quiet_node.arguments(server=True)):
        node = RR.RobotRaconteurNode.s
        RRC.RegisterStdRobDefServiceTypes(node)
        scanner = Scanner()
        node.RegisterService("scanner", TYPE, scanner)
        ends = threading.Event()

        def send():
            while not ends.wait(0.1):
                scanner.packets.AsyncSendPacket(scan(node), lambda: None)

        thread = threading.Thread(target=send)
        thread.start()
        print("ready", flush=True)
        sys.stdin.read()
        ends.set()
        thread.join()


main(int(sys.argv[1]))
