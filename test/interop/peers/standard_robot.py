"""A robot of the standard types with two joints, that moves at once to where it is told: the drivers' base class of
robotraconteur-abstract-robot, with the definitions of robotraconteurcompanion. The service "not_jogged" has one that says that it
can't be jogged.

    standard_robot.py PORT
"""
import sys
import time

import numpy as np
import quiet_node
import RobotRaconteur as RR
import RobotRaconteurCompanion as RRC
from RobotRaconteurCompanion.InfoParser import InfoParser
from robotraconteur_abstract_robot import AbstractRobot

JOINT = """
  - joint_identifier: {name: joint_%(number)d, uuid: %(uuid)s}
    joint_type: revolute
    joint_limits: {upper: 3.0, lower: -3.0, velocity: 2.0, reduced_velocity: 2.0,
                   acceleration: 5.0, reduced_acceleration: 5.0}
    default_units: radian
    default_effort_units: newton_meter
    passive: false
"""
INFO = """
device_info:
  device: {name: test_robot, uuid: 4d3b7c3e-5d5b-4e7b-9a54-3f1b0c7a1f00}
  manufacturer: {name: rrgate, uuid: 5d3b7c3e-5d5b-4e7b-9a54-3f1b0c7a1f00}
  model: {name: planar, uuid: 6d3b7c3e-5d5b-4e7b-9a54-3f1b0c7a1f00}
  user_description: Two joints in a plane
  serial_number: 123456789
  device_classes:
  - class_identifier: {name: robot, uuid: 39b513e7-21b9-4b49-8654-7537473030eb}
    subclasses: [serial]
  implemented_types: [com.robotraconteur.robotics.robot.Robot]
robot_type: serial
robot_capabilities: [jog_command, position_command, trajectory_command]
chains:
- kin_chain_identifier: planar
  H: [{x: 0, y: 0, z: 1}, {x: 0, y: 0, z: 1}]
  P: [{x: 0, y: 0, z: 0.1}, {x: 0.5, y: 0, z: 0}, {x: 0.4, y: 0, z: 0}]
  flange_identifier: tool0
  flange_pose: {orientation: {w: 1, x: 0, y: 0, z: 0}, position: {x: 0, y: 0, z: 0}}
  joint_numbers: [0, 1]
joint_info:
""" + "".join(JOINT % {"number": number, "uuid": f"7d3b7c3e-5d5b-4e7b-9a54-3f1b0c7a1f0{number}"} for number in range(2))


class PlanarRobot(AbstractRobot):
    def __init__(self, info):
        super().__init__(info, 2)
        self._update_period = 0.02
        self._joint_position = np.zeros(2)
        self._joint_velocity = np.zeros(2)
        self._joint_effort = np.zeros(2)

    def _run_timestep(self, now):
        self._last_robot_state = self._last_joint_state = self._last_endpoint_state = now
        self._enabled = self._ready = True
        self._operational_mode = self._robot_operational_mode["cobot"]
        first, second = self._joint_position[0], np.sum(self._joint_position)
        tip = [0.5 * np.cos(first) + 0.4 * np.cos(second), 0.5 * np.sin(first) + 0.4 * np.sin(second), 0.1]
        self._endpoint_pose = [self._geometry_util.xyz_rpy_to_pose(tip, [0, 0, second])]
        super()._run_timestep(now)

    def async_jog_cartesian(self, velocity, timeout, wait, handler):
        first, second = self._joint_position[0], np.sum(self._joint_position)
        arm = np.array([[-0.5 * np.sin(first), 0], [0.5 * np.cos(first), 0]])
        jacobian = arm + 0.4 * np.array([[-np.sin(second)] * 2, [np.cos(second)] * 2])
        wanted = velocity[0][0]["linear"]
        self.async_jog_joint(np.linalg.pinv(jacobian, 0.1) @ [wanted["x"], wanted["y"]], timeout, wait, handler)

    def _send_robot_command(self, now, joint_pos_cmd, joint_vel_cmd):
        if joint_pos_cmd is not None:
            self._joint_position = np.array(joint_pos_cmd)
        self._position_command, self._velocity_command = joint_pos_cmd, joint_vel_cmd

    def _send_disable(self, handler):
        handler(None)

    _send_enable = _send_reset_errors = _send_disable


def main(port):
    with RR.ServerNodeSetup("test.standard_robot", port, argv=quiet_node.arguments(server=True)):
        node = RR.RobotRaconteurNode.s
        RRC.RegisterStdRobDefServiceTypes(node)
        robots = {"robot": INFO, "not_jogged": INFO.replace("jog_command, ", "")}
        for name, info in robots.items():
            parsed = InfoParser(node).ParseInfoString(info, "com.robotraconteur.robotics.robot.RobotInfo")
            robots[name] = PlanarRobot(parsed)
            robots[name]._start_robot()
        time.sleep(0.2)
        for name, robot in robots.items():
            node.RegisterService(name, "com.robotraconteur.robotics.robot.Robot", robot)
        print("ready", flush=True)
        sys.stdin.read()
        for robot in robots.values():
            robot._close()


main(int(sys.argv[1]))
