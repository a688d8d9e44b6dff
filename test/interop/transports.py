#!/usr/bin/env python3
"""The table of transports: by which URL scheme whose clients and services understood each other in a run of the tests.

transports.py FOLDER    prints it, from the JUnit files of the stages in FOLDER (build/test-logs)

What a test shows it says itself where it is one of test/interop (fixture `carries`); of the others EVIDENCE tells. What
no test of this run has shown is no more than "not run" here, whatever an earlier run has found.
"""
import pathlib
import re
import sys
from collections import defaultdict

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "cmake"))
from junit_counts import cases, verdict_of  # noqa: E402

SCHEMES = ["rr+tcp", "rrs+tcp", "rr+ws", "rrs+ws", "rr+wss", "rrs+wss", "rr+local", "rr+usb", "rr+pci", "rr+intra"]
ROUTES = ["direct", "gateway"]
ROLES = ["our client", "our service", "reference client", "reference service"]

# (stage, pattern of its tests' names): what they carry, as in the property of the others.
EVIDENCE = {
    ("usb", r"client on USB: .*"): "ours ours rr+usb",
    ("usb", r"through rrgate and USB: .*"): "ours ours rr+tcp rr+usb",
    ("usb", r"the reference uses the device"): "reference ours rr+usb",
    ("native", r"test_dial/nodes of one process are reached by name and by ID, each on its thread"): "ours ours rr+intra",
    ("native", r"test_transport/an open device carries bytes both ways; each stream opens it anew"): "ours - rr+pci",
}

TCP_ONLY = "the gateway's clients come by TCP"
INTRA = "stays within one process, the gateway is another"
IN_PROCESS = "the reference's is of its own process: no other implementation can be in it"

HOST_ONLY = "the reference is a USB host; what it connects to is firmware"

# Why a cell can have no test; an entry without route or role is for all of them.
REASONS = {
    ("rr+local", "gateway", "our client"): TCP_ONLY,
    ("rr+local", "gateway", "reference client"): TCP_ONLY,
    ("rr+usb", "gateway", "our client"): TCP_ONLY,
    ("rr+usb", "gateway", "reference client"): TCP_ONLY,
    ("rr+usb", None, "reference service"): HOST_ONLY,
    ("rr+pci", "gateway", "our client"): TCP_ONLY,
    ("rr+pci", "gateway", "reference client"): TCP_ONLY,
    ("rr+intra", "gateway", None): INTRA,
    ("rr+intra", "direct", "reference client"): IN_PROCESS,
    ("rr+intra", "direct", "reference service"): IN_PROCESS,
}


def claims(folder):
    """(what was carried, verdict) of every test of the run that says so."""
    for file in sorted(pathlib.Path(folder).glob("*.xml")):
        for case in cases(file):
            said = [part.get("value") for part in case.iter("property") if part.get("name") == "carries"]
            said += [what for (stage, pattern), what in EVIDENCE.items()
                     if stage == file.stem and re.fullmatch(pattern, case.get("name", ""))]
            for what in said:
                yield what, verdict_of(case)


def cells_of(what):
    """A service's scheme is the one by which it is reached: by the client, or by the gateway."""
    client, service, scheme, *behind = what.split(" ")
    route = "gateway" if behind else "direct"
    owners = {"ours": "our", "reference": "reference"}
    if client in owners:
        yield scheme, route, f"{owners[client]} client"
    if service in owners:
        yield (behind or [scheme])[0], route, f"{owners[service]} service"


def collect(folder):
    """(scheme, route, role) -> verdicts of the tests that ran."""
    found = defaultdict(list)
    for what, verdict in claims(folder):
        if verdict != "skipped":
            for cell in set(cells_of(what)):
                found[cell].append(verdict)
    return found


def reason_for(scheme, route, role):
    for key in ((scheme, route, role), (scheme, None, role), (scheme, route, None)):
        if key in REASONS:
            return REASONS[key]
    return None


def format_table(found):
    notes = []

    def cell(scheme, route, role):
        verdicts = found.get((scheme, route, role), [])
        if "failed" in verdicts:
            return f"**FAILED** {verdicts.count('failed')} of {len(verdicts)}"
        if verdicts:
            return f"passed {len(verdicts)}"
        reason = reason_for(scheme, route, role)
        if not reason:
            return "not run"
        if reason not in notes:
            notes.append(reason)
        return f"can't exist ({notes.index(reason) + 1})"

    rows = [["Scheme", *(f"{role}, {route}" for route in ROUTES for role in ROLES)], ["---"] * (1 + len(ROUTES) * len(ROLES))]
    rows += [[scheme, *(cell(scheme, route, role) for route in ROUTES for role in ROLES)] for scheme in SCHEMES]
    text = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    return ("# Transports\n\nHow many tests of this run a scheme has passed. Through the gateway, a client's scheme is the one "
            "to the gateway, a service's the one by which the gateway reaches it. No node has HTTPS of its own: services have been tested "
            "behind a proxy that has. At buses (`rr+usb`, `rr+pci`) a program plays the device, in front of the service.\n\n" + text + "\n"
            + "".join(f"{number}. {note[0].upper()}{note[1:]}.\n" for number, note in enumerate(notes, 1)))


if __name__ == "__main__":
    print(format_table(collect(sys.argv[1])), end="")
