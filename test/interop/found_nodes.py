"""Programs that are found, and that find: ours and the reference's."""
import json
import sys
import time

from processes import BUILD, ROOT

OURS = BUILD / "test" / "interop" / "cpp" / "rr-test-discovery"
THEIRS = [sys.executable, str(ROOT / "test" / "interop" / "peers" / "found_node.py")]
TYPE = "experimental.found.Thing"
FIND_DEADLINE = 5.0  # seconds


class Watch:
    """rr-test-discovery watch on a host: its events as they come."""

    def __init__(self, process):
        self._process = process
        assert json.loads(process.next_line()) == {"ready": True}

    def wait_for(self, is_wanted, seconds=FIND_DEADLINE):
        """The first event from here on that is_wanted(event)."""
        deadline = time.monotonic() + seconds
        while True:
            event = json.loads(self._process.next_line(within=deadline - time.monotonic()))
            if is_wanted(event):
                return event
