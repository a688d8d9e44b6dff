"""Subscriptions of the reference implementation, one for each URL.

subscriber.py URL...    prints {"connected"} when all are; at each line on standard input: waits until all are again, and
                        prints for each URL {"losses": how often it was lost, "value": what add(1, 2) brings}
"""
import json
import sys

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
        try:
            value = self.client().add(1, 2)
        except RR.RobotRaconteurException:  # it was lost in between
            value = self.client().add(1, 2)
        return {"losses": self.losses, "value": value}


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
