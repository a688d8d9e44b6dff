"""A device that a gateway shares."""
import json

from directions import DIRECTIONS, service_command
from processes import Background

OURS = next(each for each in DIRECTIONS if each.name == "reference-to-ours")


def port_of(url):
    return int(url.split(":")[2].split("/")[0])


def start_service(folder, *options):
    """The test service, as ours is."""
    service = Background([*service_command(OURS, "v4", "http://localhost"), *options], folder / "service.log")
    return service, json.loads(service.next_line())["url"]
