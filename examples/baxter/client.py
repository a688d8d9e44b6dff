"""Closes the left gripper, turns the left hand, and drives half a metre: a client of the real package, in the standard types.

    client.py URL_OF_THE_BASE
"""
import sys
import time

import RobotRaconteur as RR

ARM = "com.robotraconteur.robotics.robot"
JOINT, ANGLE, SPEED = 6, 0.5, 0.25  # left_w2; rad; m/s


def main(url):
    node = RR.RobotRaconteurNode.s
    with RR.ClientNodeSetup(argv=["--robotraconteur-log-level=WARNING"]):
        base, arm, gripper = (node.ConnectService(url.replace("service=base", f"service={name}"))
                              for name in ("base", "left_arm", "left_gripper"))
        gripper.close()
        arm.enable()
        modes = node.GetConstants(ARM, arm)["RobotCommandMode"]
        arm.command_mode = modes["halt"]
        arm.command_mode = modes["jog"]
        state, _ = arm.robot_state.PeekInValue()
        goal = state.joint_position.copy()
        goal[JOINT] += ANGLE
        arm.jog_freespace(goal, [0.5] * len(goal), True)
        arm.command_mode = modes["halt"]
        until = time.monotonic() + 0.5 / SPEED
        while time.monotonic() < until:
            base.drive(SPEED, 0.0)
            time.sleep(0.1)
        base.halt()
        state, _ = arm.robot_state.PeekInValue()
        place, _ = base.state.PeekInValue()
        held, _ = gripper.tool_state.PeekInValue()
        print(f"x {place.x:.2f}, wrist {state.joint_position[JOINT]:.2f}, gripper {held.position:.2f}")


main(sys.argv[1])
