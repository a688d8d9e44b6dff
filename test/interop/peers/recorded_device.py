"""A device of the real package whose members say something whenever it is told to.

recorded_device.py PORT
"""
import sys

import RobotRaconteur as RR

import quiet_node

DEFINITION = """service experimental.recorded
stdver 0.10
struct Pose
    field double[3] position
    field string name
end
object Axis
    wire double angle [readonly]
    pipe double turns [readonly]
    event turned(double angle)
end
object Device
    property int32 gain
    pipe Pose poses [readonly]
    event said(string text, int32 number)
    objref Axis{int32} axes
    function void tell(int32 number)
    function void release_axis()
end
"""


class Axis:
    def __init__(self):
        self.turned = RR.EventHook()


class Device:
    def __init__(self):
        self.gain = 0
        self.said = RR.EventHook()
        self.axis = Axis()

    def get_axes(self, index):
        return self.axis, "experimental.recorded.Axis"

    def tell(self, number):
        node = RR.RobotRaconteurNode.s
        self.gain = number
        pose = node.NewStructure("experimental.recorded.Pose")
        pose.position, pose.name = [number, 0.5, -1e-300], f"pose \u00e4 {number}"
        self.poses.AsyncSendPacket(pose, lambda: None)
        self.said.fire("hello, \"you\"", number)
        self.axis.angle.OutValue = number * 0.1
        self.axis.turns.AsyncSendPacket(number * 0.1, lambda: None)
        self.axis.turned.fire(number * 0.1)

    def release_axis(self):
        RR.ServerContext.GetCurrentServerContext().ReleaseServicePath("device.axes[3]")
        self.axis = Axis()


if __name__ == "__main__":
    with RR.ServerNodeSetup("experimental.recorded_device", int(sys.argv[1]),
                            argv=[f"--robotraconteur-{name}={value}" for name, value in quiet_node.QUIET.items()]):
        RR.RobotRaconteurNode.s.RegisterServiceType(DEFINITION)
        RR.RobotRaconteurNode.s.RegisterService("device", "experimental.recorded.Device", Device())
        print("ready", flush=True)
        sys.stdin.read()
