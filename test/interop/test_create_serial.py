"""The service of examples/create-minimal in Python, with the real package, on the robot of bytes that the one in C++ has."""
import sys
import unittest

from gateways import RRGATE
from processes import ROOT
from serial_scenarios import SerialScenarios


class TestCreateSerial(SerialScenarios, unittest.TestCase):
    COMMAND = [sys.executable, ROOT / "examples" / "create-minimal" / "create_serial.py"]
    OPTIONS = [f"--robotraconteur-{name}=false" for name in ("local-enable", "discovery-announce-enable", "discovery-listening-enable")]
    RRGATE = RRGATE
