"""Node options of both peers: nothing but TCP on the loopback, unless the command line says otherwise."""
import sys

QUIET = {
    "discovery-listening-enable": "false",
    "discovery-announce-enable": "false",
    "local-enable": "false",
    "intra-enable": "false",
    "log-level": "WARNING",
}
QUIET_SERVER = {"tcp-listen-localhost": "true"}


def arguments(server):
    """The node's argv: our defaults, then the command line's own options, which win (an option may stand only once)."""
    given = [word for word in sys.argv[1:] if word.startswith("--robotraconteur-")]
    names = {word.split("=")[0].removeprefix("--robotraconteur-") for word in given}
    defaults = {**QUIET, **(QUIET_SERVER if server else {})}
    return [f"--robotraconteur-{name}={value}" for name, value in defaults.items() if name not in names] + given
