"""The reference implementation in the discovery tests: announces a node, or searches. One line of JSON on standard output.

found_node.py serve NAME NODEID [PORT] [ipv4]   a node with the service "thing"; runs until its standard input ends
found_node.py serve-local NAME [public]         the same by rr+local alone, with the NodeID that the machine keeps for NAME
found_node.py call-local URL                    what the thing at this rr+local URL says
found_node.py find-type TYPE                    its services, on nodes that it hears of within three seconds
found_node.py detected [ipv4]                   those nodes
found_node.py subscribe-type TYPE               connections to its services that come, with what their property "one" is, and go
found_node.py connect-device TYPE DEVICE TAG    the same of the service whose attributes have this device and tag, by the
                                                DeviceConnector of robotraconteurcompanion
"""
import json
import sys
import threading
import time

import RobotRaconteur as RR

DEFINITION = """service experimental.found
object Thing
  property int32 one [readonly]
end
"""
# Local transports would find everybody through the file system.
QUIET = ["local-enable=false", "local-start-server=false", "local-start-client=false", "intra-enable=false",
         "log-level=WARNING"]


class Thing:
    one = 1


def options(ip, *more):
    scopes = ["tcp-ipv6-discovery=false", "tcp-ipv4-discovery=true"] if ip == "ipv4" else ["tcp-ipv6-discovery=true"]
    return [f"--robotraconteur-{option}" for option in [*QUIET, *scopes, *more]]


def serve(name, node_id, port="0", ip="ipv6"):
    with RR.ServerNodeSetup(name, int(port), argv=options(ip, "discovery-announce-enable=true", f"nodeid={node_id}")):
        offer_thing()


def offer_thing():
    node = RR.RobotRaconteurNode.s
    node.RegisterServiceType(DEFINITION)
    node.RegisterService("thing", "experimental.found.Thing", Thing())
    print(json.dumps({"ready": True, "id": str(node.NodeID.ToString()).strip("{}")}), flush=True)
    sys.stdin.read()


def serve_local(name, reach="private"):
    given = [*QUIET[2:], "tcp-enable=false", "local-enable=true", "local-start-server=true",
             f"local-server-public={'true' if reach == 'public' else 'false'}"]
    with RR.ServerNodeSetup(name, 0, argv=[f"--robotraconteur-{option}" for option in given]):
        offer_thing()


def call_local(url):
    with RR.ClientNodeSetup(argv=["--robotraconteur-local-enable=true", "--robotraconteur-log-level=WARNING"]):
        print(json.dumps({"one": RR.RobotRaconteurNode.s.ConnectService(url).one}))


def search(what, argument=None):
    with RR.ClientNodeSetup(argv=options(argument, "discovery-listening-enable=true")):
        node = RR.RobotRaconteurNode.s
        time.sleep(3)  # FindServiceByType asks only nodes that are known when it is called
        if what == "find-type":
            found = node.FindServiceByType(argument, ["rr+tcp"])
            print(json.dumps([{"node": info.NodeName, "name": info.Name, "url": list(info.ConnectionURL)} for info in found]))
        else:
            node.UpdateDetectedNodes(["rr+tcp"])
            found = node.GetDetectedNodes()
            print(json.dumps([str(each.ToString()).strip("{}") for each in found]))


def say_event(event, service, one):
    print(json.dumps({"event": event, "id": service.NodeID.ToString().strip("{}"), "service": service.ServiceName, "one": one}),
          flush=True)


def follow(subscription):
    """Until standard input ends."""
    def say_connected(_, service, client):
        threading.Thread(target=lambda: say_event("connected", service, client.one), daemon=True).start()

    subscription.ClientConnected += say_connected  # a connection takes longer than to get here
    subscription.ClientDisconnected += lambda _, service, client: say_event("lost", service, None)
    print(json.dumps({"ready": True}), flush=True)
    sys.stdin.read()


def subscribe_type(type_name):
    with RR.ClientNodeSetup(argv=options("", "discovery-listening-enable=true")):
        follow(RR.RobotRaconteurNode.s.SubscribeServiceByType([type_name]))


def connect_device(type_name, device, tag):
    from RobotRaconteurCompanion.Util.DeviceConnector import DeviceConnector, DeviceConnectorDetails
    with RR.ClientNodeSetup(argv=options("", "discovery-listening-enable=true")):
        details = DeviceConnectorDetails("thing", device=device, tags=[tag], root_object_type=type_name)
        connector = DeviceConnector([details])
        follow(connector.GetDevice("thing"))
        connector.Close()


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve(*sys.argv[2:])
    elif sys.argv[1] == "serve-local":
        serve_local(*sys.argv[2:])
    elif sys.argv[1] == "call-local":
        call_local(*sys.argv[2:])
    elif sys.argv[1] == "subscribe-type":
        subscribe_type(*sys.argv[2:])
    elif sys.argv[1] == "connect-device":
        connect_device(*sys.argv[2:])
    else:
        search(*sys.argv[1:])
