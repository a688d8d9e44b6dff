"""The configuration of leases that tests use, and what becomes of the device when one ends."""
import time

PLAIN = "/api/v1/devices/interop/plain"
LEASES = {
    "members": [{"member": "plain.finish", "lease": "never"}, {"member": "plain.speed", "lease": "required"}],
    "safe": [{"property": "plain.speed", "value": 0}, {"wire": "plain.target", "value": -1}],
    "takeover": ["operator", "admin"],
}
REFUSED = {**LEASES, "safe": [{"call": "plain.ask", "arguments": ["may it stop?"]}]}  # whom nobody answers
UNANSWERED = {**LEASES, "safe": [{"call": "plain.move", "arguments": [0]}]}  # until the device is told to finish


def wait_for(is_so, within=10):
    begin = time.monotonic()
    while not is_so():
        assert time.monotonic() - begin < within, "not in time"
        time.sleep(0.005)
    return time.monotonic() - begin
