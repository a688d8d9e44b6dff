"""Subscriptions of the reference implementation, one for each URL.

subscriber.py URL...    prints {"connected"} when all are; at each line on standard input: waits until all are again, and
                        prints for each URL {"losses": how often it was lost, "value": what add(1, 2) brings}
"""
import json
import sys
import time

import RobotRaconteur as RR

PATIENCE = 30.0  # seconds for a connection


class Subscribed:
    def __init__(self, url):
        self.losses = 0
        self._subscription = RR.RobotRaconteurNode.s.SubscribeService(url)
        self._subscription.ClientDisconnected += self._lost

    def _lost(self, subscription, id, client):
        self.losses += 1

    def client(self):
        return self._subscription.GetDefaultClientWait(PATIENCE)

    def tell(self):
        end = time.monotonic() + PATIENCE
        while True:
            try:
                return {"value": self.client().add(1, 2), "losses": self.losses}
            except (RR.ConnectionException, RR.InvalidEndpointException):
                # A subscription hands out a client whose connection has ended until it has seen the end itself.
                if time.monotonic() > end:
                    raise
                time.sleep(0.05)


def main():
    with RR.ClientNodeSetup(argv=sys.argv):
        subscriptions = [Subscribed(url) for url in sys.argv[1:]]
        for subscribed in subscriptions:
            subscribed.client()
        print(json.dumps({"connected": True}), flush=True)
        for _ in sys.stdin:
            print(json.dumps([subscribed.tell() for subscribed in subscriptions]), flush=True)


if __name__ == "__main__":
    main()
