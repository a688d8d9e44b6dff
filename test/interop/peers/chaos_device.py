"""A device of the reference implementation for chaos.py: experimental.chaos.

    chaos_device.py JOURNAL --robotraconteur-tcp-port=PORT

JOURNAL gets a line for each call that has run; it is there even when the device is killed right behind. Prints one line of
JSON when it is ready, {"url": "..."}, and runs until its standard input ends.
"""
import json
import os
import pathlib
import sys
import threading
import time

import RobotRaconteur as RR

import quiet_node

DEFINITION = pathlib.Path(__file__).parent.parent / "experimental.chaos.robdef"
TYPE = "experimental.chaos"
USERS = "gateway 5ebe2294ecd0e0f08eab7690d2a6ee69 objectlock\n"  # password: secret
TICK = 0.02  # seconds


class Vault:
    def __init__(self):
        self.owner = 0.0


class Chaos:
    def __init__(self, journal):
        self._journal = os.open(journal, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        self._vault = Vault()
        self.ticked = RR.EventHook()
        self._echoing = threading.Lock()

    def RRServiceObjectInit(self, context, path):
        self.echo.PipeConnectCallback = self._connect_echo
        self.value.OutValue = 0.0
        threading.Thread(target=self._tick, daemon=True).start()

    def _tick(self):
        number = float(int(time.monotonic()) * 1000)
        while True:
            self.ticked.fire(number)
            number += 1
            time.sleep(TICK)

    def _connect_echo(self, endpoint):
        def echo(from_endpoint):
            with self._echoing:  # callbacks of the package may run side by side
                while from_endpoint.Available:
                    from_endpoint.AsyncSendPacket(from_endpoint.ReceivePacket(), lambda number, error: None)

        endpoint.PacketReceivedEvent += echo

    def once(self, token):
        os.write(self._journal, f"{token:.0f}\n".encode())
        return token

    def publish(self, value):
        self.value.OutValue = value

    def get_vault(self):
        return self._vault, TYPE + ".Vault"


def main():
    node = RR.RobotRaconteurNode.s
    with RR.ServerNodeSetup("chaos.device", 0, argv=quiet_node.arguments(server=True)) as setup:
        node.RegisterServiceType(DEFINITION.read_text(encoding="ascii"))
        policy = RR.ServiceSecurityPolicy(RR.PasswordFileUserAuthenticator(USERS), {"allowobjectlock": "true"})
        node.RegisterService("chaos", TYPE + ".Chaos", Chaos(sys.argv[1]), policy)
        print(json.dumps({"url": f"rr+tcp://127.0.0.1:{setup.tcp_transport.GetListenPort()}/?service=chaos"}), flush=True)
        sys.stdin.buffer.read()


if __name__ == "__main__":
    main()
