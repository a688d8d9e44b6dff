"""A service whose names, texts and documentation are what JavaScript and HTML might trip over.

    hostile.py PORT
"""
import sys
import threading

import RobotRaconteur as RR

DEFINITION = """
service test.hostile
stdver 0.10
enum constructor
    ## <script>document.title = "broken in"</script>
    valueOf = 0,
    prototype
end
struct Struct
    ## <img src=x onerror="document.title = 'broken in'"> [</td>]
    field double then
    field string toString
    field constructor hasOwnProperty
    field double{string} constructors
end
object Hostile
    ## <img src=x onerror="document.title = 'broken in'">
    wire Struct then [readonly]
    ## <script>document.title = "broken in"</script>
    property Struct constructor
    property double valueOf
    function Struct toString(Struct then, string{list} prototype)
    function string{generator} hasOwnProperty()
    event isPrototypeOf(string then)
    pipe string propertyIsEnumerable
    memory uint8[] toLocaleString
end
"""
HTML = """<img src=x onerror="document.title='broken in'">"""


class Hostile:
    def __init__(self):
        self.valueOf = 1.0
        self.constructor = make()
        self.isPrototypeOf = RR.EventHook()
        self.toLocaleString = RR.ArrayMemory(bytearray_of(HTML))

    def toString(self, then, prototype):
        return then

    def hasOwnProperty(self):
        return Words()


class Words:
    def __init__(self):
        self.left = 3

    def Next(self):
        self.left -= 1
        if self.left < 0:
            raise RR.StopIterationException()
        return HTML

    def Abort(self):
        self.left = 0

    def Close(self):
        self.left = 0


def bytearray_of(text):
    import numpy as np
    return np.frombuffer(text.encode(), dtype=np.uint8).copy()


def make():
    value = RR.RobotRaconteurNode.s.NewStructure("test.hostile.Struct")
    value.then, value.toString, value.hasOwnProperty = 2.5, HTML, 1
    value.constructors = {"__proto__": 1.0, HTML: 2.0}
    return value


def main():
    with RR.ServerNodeSetup("test.hostile", int(sys.argv[1]), argv=["--robotraconteur-local-enable=false"]):
        node = RR.RobotRaconteurNode.s
        node.RegisterServiceType(DEFINITION)
        hostile = Hostile()
        node.RegisterService("hostile", "test.hostile.Hostile", hostile)
        stop = threading.Event()

        def tick():
            while not stop.wait(0.05):
                hostile.then.OutValue = make()
                hostile.isPrototypeOf.fire(HTML)
        threading.Thread(target=tick, daemon=True).start()
        print("ready", flush=True)
        sys.stdin.read()
        stop.set()


main()
