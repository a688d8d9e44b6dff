"""Baxter on Wheels, simulated: two arms of seven joints with grippers and three cameras, on a wheelchair.

    baxter.py [--port N] [--host HOST]

The arms are robots of the standard types, by the drivers' base class of robotraconteur-abstract-robot; the grippers are
tools, the cameras cameras. Geometry and limits of the joints are those that Rethink Robotics published for Baxter.
"""
import argparse
import math
import pathlib
import signal
import struct
import sys
import threading
import time
import zlib

try:
    import general_robotics_toolbox as rox
    import numpy as np
    import RobotRaconteur as RR
    import RobotRaconteurCompanion as RRC
    from RobotRaconteurCompanion.InfoParser import InfoParser
    from RobotRaconteurCompanion.Util.DateTimeUtil import DateTimeUtil
    from robotraconteur_abstract_robot import AbstractRobot
except ModuleNotFoundError as missing:
    sys.exit(f"baxter: {missing}; install it by: python3 -m pip install robotraconteur-abstract-robot")

SIDES = ("left", "right")
WIDTH, HEIGHT = 160, 120
FRAME_PERIOD, BASE_PERIOD, GRIPPER_PERIOD = 0.1, 0.02, 0.05  # seconds
HEAD_HEIGHT = 1.6  # of its camera, in metres

# name, axis, metres from the joint before (the first: from the middle of the base), limits in rad, rad/s
JOINTS = (
    ("s0", "z", (0.063, 0.259, 1.0), (-1.7016, 1.7016), 2.0),
    ("s1", "y", (0.069, 0.0, 0.27035), (-2.147, 1.047), 2.0),
    ("e0", "x", (0.102, 0.0, 0.0), (-3.0541, 3.0541), 2.0),
    ("e1", "y", (0.26242, 0.0, -0.069), (-0.05, 2.618), 2.0),
    ("w0", "x", (0.10359, 0.0, 0.0), (-3.059, 3.059), 4.0),
    ("w1", "y", (0.2707, 0.0, -0.01), (-1.5707, 2.094), 4.0),
    ("w2", "x", (0.115975, 0.0, 0.0), (-3.059, 3.059), 4.0),
)
HAND = (0.11355, 0.0, 0.0)  # behind the last joint
AT_START = (0.0, -0.55, 0.0, 0.75, 0.0, 1.26, 0.0)


def vector(x, y, z):
    return f"{{x: {x}, y: {y}, z: {z}}}"


def device_info(name, kind, types, number):
    return f"""
device_info:
  device: {{name: {name}, uuid: 6fd5c3a0-61d4-4f0c-9f0e-0000000000{number:02x}}}
  manufacturer: {{name: rrgate, uuid: 6fd5c3a0-61d4-4f0c-9f0e-0000000000f0}}
  model: {{name: simulated_baxter, uuid: 6fd5c3a0-61d4-4f0c-9f0e-0000000000f1}}
  user_description: {name.replace("_", " ")} of a simulated Baxter on Wheels
  serial_number: "{number}"
  device_classes:
  - class_identifier: {{name: {kind}, uuid: 6fd5c3a0-61d4-4f0c-9f0e-0000000000f2}}
    subclasses: []
  implemented_types: [{types}]
"""


def arm_info(side, number):
    mirror = 1 if side == "left" else -1
    places = [(x, y * mirror, z) for _, _, (x, y, z), _, _ in JOINTS] + [HAND]
    axes = [tuple(float(axis == each) for each in "xyz") for _, axis, *_ in JOINTS]
    joints = "".join(f"""
- joint_identifier: {{name: {side}_{name}, uuid: 6fd5c3a0-61d4-4f0c-9f0e-00000000{number:02x}{i:02x}}}
  joint_type: revolute
  joint_limits: {{upper: {high}, lower: {low}, velocity: {speed}, reduced_velocity: {speed / 2},
                 acceleration: 6.0, reduced_acceleration: 3.0}}
  default_units: radian
  default_effort_units: newton_meter
  passive: false""" for i, (name, _, _, (low, high), speed) in enumerate(JOINTS))
    return device_info(f"{side}_arm", "robot", "com.robotraconteur.robotics.robot.Robot", number) + f"""
robot_type: serial
robot_capabilities: [jog_command, position_command, velocity_command, trajectory_command]
chains:
- kin_chain_identifier: {side}
  H: [{", ".join(vector(*each) for each in axes)}]
  P: [{", ".join(vector(*each) for each in places)}]
  flange_identifier: {side}_hand
  flange_pose: {{orientation: {{w: 1, x: 0, y: 0, z: 0}}, position: {vector(0, 0, 0)}}}
  joint_numbers: [0, 1, 2, 3, 4, 5, 6]
joint_info:{joints}
"""


class Arm(AbstractRobot):
    def __init__(self, info):
        super().__init__(info, len(JOINTS))
        self._update_period = 0.02
        self._joint_position = np.array(AT_START)
        self._joint_velocity, self._joint_effort = np.zeros(7), np.zeros(7)
        self._enabled = True

    def halt(self):  # the base class has none
        self.command_mode = self._robot_command_mode["halt"]

    def hand(self):
        """The hand's place and rotation, from the base."""
        at = rox.fwdkin(self._rox_robots[0], self._joint_position)
        return at.p, at.R

    def _run_timestep(self, now):
        self._last_robot_state = self._last_joint_state = self._last_endpoint_state = now
        self._ready = self._enabled
        self._operational_mode = self._robot_operational_mode["cobot"]
        place, rotation = self.hand()
        self._endpoint_pose = [self._geometry_util.rox_transform_to_pose(rox.Transform(rotation, place))]
        super()._run_timestep(now)

    def _send_robot_command(self, now, positions, velocities):
        self._joint_velocity = np.zeros(7)
        if positions is not None:
            self._joint_velocity = (positions - self._joint_position) / self._update_period
            self._joint_position = np.array(positions)
        elif velocities is not None:
            self._joint_velocity = np.array(velocities)
            self._joint_position = self._joint_position + self._joint_velocity * self._update_period
        self._position_command, self._velocity_command = positions, velocities

    def _send_enable(self, handler):
        self._enabled = True
        handler(None)

    def _send_disable(self, handler):
        self._enabled = False
        handler(None)

    def _send_reset_errors(self, handler):
        handler(None)


class Gripper:
    """Opens and closes in half a second; 0 is closed, 1 is open."""

    SPEED = 2.0

    def __init__(self, node, side, number):
        self.tool_info = InfoParser(node).ParseInfoString(
            device_info(f"{side}_gripper", "tool", "com.robotraconteur.robotics.tool.Tool", number) + """
tool_type: electric_gripper
tool_capabilities: [open_close_command, continuous_command]
tcp: {rotation: {w: 1, x: 0, y: 0, z: 0}, translation: {x: 0.1, y: 0, z: 0}}
actuation_time: 0.5
close_position: 0.0
open_position: 1.0
command_min: 0.0
command_max: 1.0
command_close: 0.0
command_open: 1.0
""", "com.robotraconteur.robotics.tool.ToolInfo")
        self.device_info = self.tool_info.device_info
        self._flags = node.GetConstants("com.robotraconteur.robotics.tool")["ToolStateFlags"]
        self._state = node.NewStructure("com.robotraconteur.robotics.tool.ToolState")
        self._clock = DateTimeUtil(node)
        self._position = self._command = 1.0

    def open(self):
        self._command = 1.0

    def close(self):
        self._command = 0.0

    def halt(self):
        self._command = self._position

    def setf_command(self, command):
        if not 0 <= command <= 1:
            raise RR.InvalidArgumentException(f"command is {command}, expected 0 (closed) to 1 (open)")
        self._command = command

    def enable(self):
        pass

    disable = reset_errors = home = enable

    def move(self):
        step = self.SPEED * GRIPPER_PERIOD
        self._position += min(max(self._command - self._position, -step), step)
        place = "opened" if self._position == 1 else "closed" if self._position == 0 else "between"
        flags = ["enabled", "ready", place] + (["actuating"] if self._position != self._command else [])
        state = self._state
        state.ts, state.seqno = self._clock.TimeSpec3Now(), state.seqno + 1
        state.tool_state_flags = sum(self._flags[each] for each in flags)
        state.position, state.command = self._position, self._command
        self.tool_state.OutValue = state


class Base:
    """A wheelchair that does what it is told, within its limits, and stops where nobody tells it for HOLD seconds."""

    def __init__(self, node):
        self._state = node.NewStructure("experimental.baxter.BaseState")
        constants = node.GetConstants("experimental.baxter")["Base"]
        self._limits, self._hold = (constants["MAX_SPEED"], constants["MAX_TURN"]), constants["HOLD"]
        self._stops_at = 0.0

    def drive(self, speed, turn):
        for name, value, limit in zip(("speed", "turn"), (speed, turn), self._limits):
            if not abs(value) <= limit:
                raise RR.InvalidArgumentException(f"{name} is {value}, expected -{limit} to {limit}")
        self._stops_at = time.monotonic() + self._hold
        self._state.speed, self._state.turn = speed, turn

    def halt(self):
        self._state.speed = self._state.turn = 0.0

    def place(self):
        """Its middle on the floor, and its rotation."""
        return np.array([self._state.x, self._state.y, 0.0]), rox.rot([0, 0, 1], self._state.heading)

    def move(self):
        if time.monotonic() > self._stops_at:
            self.halt()
        state = self._state
        state.heading += state.turn * BASE_PERIOD
        state.x += state.speed * BASE_PERIOD * math.cos(state.heading)
        state.y += state.speed * BASE_PERIOD * math.sin(state.heading)
        self.state.OutValue = state


class Camera:
    """Sees a floor of squares, and a sky. `place` gives where it is and how it is turned; it looks along its x axis."""

    def __init__(self, node, name, number, place):
        self.camera_info = InfoParser(node).ParseInfoString(
            device_info(name, "camera", "com.robotraconteur.imaging.Camera", number), "com.robotraconteur.imaging.camerainfo.CameraInfo")
        self.device_info = self.camera_info.device_info
        constants = node.GetConstants("com.robotraconteur.imaging")
        self.capabilities = constants["Capabilities"]["still"] | constants["Capabilities"]["stream"]
        self._flags, self._modes = constants["CameraStateFlags"], constants["TriggerMode"]
        self._encodings = node.GetConstants("com.robotraconteur.image")["ImageEncoding"]
        self._node, self._place, self._clock = node, place, DateTimeUtil(node)
        self._state = node.NewStructure("com.robotraconteur.imaging.CameraState")
        self._is_streaming = True
        u, v = np.meshgrid(np.linspace(-1, 1, WIDTH), np.linspace(-HEIGHT / WIDTH, HEIGHT / WIDTH, HEIGHT))
        self._rays = np.stack([np.ones_like(u), -u, -v], axis=-1)  # 90 degrees wide

    @property
    def trigger_mode(self):
        return self._modes["continuous"]

    @trigger_mode.setter
    def trigger_mode(self, mode):
        if mode != self._modes["continuous"]:
            raise RR.InvalidArgumentException(f"trigger_mode is {mode}, expected {self._modes['continuous']} (continuous)")

    def start_streaming(self):
        self._is_streaming = True

    def stop_streaming(self):
        self._is_streaming = False

    def RRServiceObjectInit(self, _context, _path):
        self.frame_stream.MaxBacklog = self.frame_stream_compressed.MaxBacklog = 2

    def _look(self):
        """Its picture: rows of red, green and blue."""
        place, rotation = self._place()
        rays = self._rays @ rotation.T
        falls = rays[..., 2] < -1e-3
        distance = np.where(falls, place[2] / np.maximum(-rays[..., 2], 1e-3), 0)[..., None]
        floor = place + rays * distance
        is_dark = (np.floor(floor[..., 0] * 2) + np.floor(floor[..., 1] * 2)) % 2 == 0
        shade = np.where(is_dark, 70, 200) * np.exp(-distance[..., 0] / 12)
        pixels = np.stack([shade, shade, shade * 0.9 + 20], axis=-1)
        pixels[~falls] = (150, 190, 230)
        return pixels.astype(np.uint8)

    def _image(self, type_name, encoding, data):
        image = self._node.NewStructure("com.robotraconteur.image." + type_name)
        info = image.image_info = self._node.NewStructure("com.robotraconteur.image.ImageInfo")
        info.width, info.height, info.step = WIDTH, HEIGHT, WIDTH * 3
        info.encoding = self._encodings[encoding]
        image.data = np.frombuffer(data, dtype=np.uint8)
        return image

    def capture_frame(self):
        return self._image("Image", "rgb888", self._look().tobytes())

    def capture_frame_compressed(self):
        return self._image("CompressedImage", "compressed", png(self._look()))

    def trigger(self):
        raise RR.InvalidOperationException("the camera takes pictures continuously: trigger_mode is continuous")

    def send(self):
        state = self._state
        state.ts, state.seqno = self._clock.TimeSpec3Now(), state.seqno + 1
        state.state_flags = self._flags["ready"] | (self._flags["streaming"] if self._is_streaming else 0)
        self.camera_state.OutValue = state
        if not self._is_streaming:
            return
        for pipe, take in ((self.frame_stream, self.capture_frame), (self.frame_stream_compressed, self.capture_frame_compressed)):
            if pipe.ActivePipeEndpointCount > 0:
                pipe.AsyncSendPacket(take(), lambda: None)


def png(pixels):
    """As PNG (ISO/IEC 15948), rows unfiltered."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    head = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b"")


def every(period, work):
    """Until the program ends."""

    def run():
        due = time.monotonic()
        while True:
            work()
            due = max(due + period, time.monotonic())
            time.sleep(max(0, due - time.monotonic()))

    threading.Thread(target=run, daemon=True).start()


def serve(node):
    """Registers all services. Returns the arms, which are to be closed."""
    RRC.RegisterStdRobDefServiceTypes(node)
    node.RegisterServiceType(pathlib.Path(__file__).with_name("experimental.baxter.robdef").read_text(encoding="ascii"))
    parser = InfoParser(node)
    base = Base(node)
    arms, grippers, cameras = {}, {}, {}
    for i, side in enumerate(SIDES):
        arms[side] = Arm(parser.ParseInfoString(arm_info(side, i), "com.robotraconteur.robotics.robot.RobotInfo"))
        arms[side]._start_robot()
        grippers[side] = Gripper(node, side, 2 + i)

    def on_base(place, rotation):
        origin, turned = base.place()
        return origin + turned @ place, turned @ rotation

    down = rox.rot([0, 1, 0], 0.35)
    cameras["head"] = Camera(node, "head_camera", 4, lambda: on_base(np.array([0.1, 0, HEAD_HEIGHT]), down))
    for i, (side, arm) in enumerate(arms.items()):
        cameras[side] = Camera(node, f"{side}_camera", 5 + i, lambda arm=arm: on_base(*arm.hand()))

    node.RegisterService("base", "experimental.baxter.Base", base)
    for side in SIDES:
        node.RegisterService(f"{side}_arm", "com.robotraconteur.robotics.robot.Robot", arms[side])
        node.RegisterService(f"{side}_gripper", "com.robotraconteur.robotics.tool.Tool", grippers[side])
    for name, camera in cameras.items():
        node.RegisterService(f"{name}_camera", "com.robotraconteur.imaging.Camera", camera)
    every(BASE_PERIOD, base.move)
    for gripper in grippers.values():
        every(GRIPPER_PERIOD, gripper.move)
    every(FRAME_PERIOD, lambda: [camera.send() for camera in cameras.values()])
    return arms.values()


def listen(transport, port, is_local):
    """The transport does not take a port again until the connections of the program before are forgotten: a minute."""
    until = time.monotonic() + 90
    while True:
        try:
            return transport.StartServer(port, is_local)
        except Exception as refused:
            if "in use" not in str(refused) or time.monotonic() > until:
                raise
        time.sleep(1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--port", type=int, default=52223)
    parser.add_argument("--host", choices=("127.0.0.1", "0.0.0.0"), default="127.0.0.1")
    given = parser.parse_args()
    options = {"discovery-announce-enable": "false", "discovery-listening-enable": "false", "local-enable": "false",
               "tcp-start-server": "false", "log-level": "WARNING"}
    arguments = [f"--robotraconteur-{name}={value}" for name, value in options.items()]
    with RR.ServerNodeSetup("experimental.baxter", given.port, argv=arguments) as setup:
        arms = serve(RR.RobotRaconteurNode.s)
        listen(setup.tcp_transport, given.port, given.host == "127.0.0.1")  # who comes finds all services
        print(f"listening rr+tcp://127.0.0.1:{given.port}/?service=base", flush=True)
        signal.sigwait({signal.SIGINT, signal.SIGTERM})
        for arm in arms:
            arm._close()


if __name__ == "__main__":
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    main()
