"""Runs commands of rrgate, and a bash at a terminal that completes them."""
import contextlib
import os
import pty
import subprocess

from gateways import RRGATE

DONE, FAILED, NOT_UNDERSTOOD, UNREACHABLE, REFUSED, DEVICE_ERROR = range(6)


class Ran:
    def __init__(self, arguments, given="", environment={}):
        done = subprocess.run([RRGATE, *map(str, arguments)], input=given, capture_output=True, text=True, timeout=30,
                              env={**os.environ, **environment})
        self.code, self.out, self.error = done.returncode, done.stdout, done.stderr

    def refused(self, code, *words):
        """Whether it ended so, with one sentence that has these words."""
        assert self.code == code, (self.code, self.out, self.error)
        assert self.out == "" and self.error.count("\n") == 1, (self.out, self.error)
        assert all(word in self.error for word in words), self.error
        return True


def run(*arguments, **more):
    ran = Ran(arguments, **more)
    assert ran.code == DONE, (ran.code, ran.error)
    return ran.out.strip()


def complete(*words, **more):
    """What a shell is told may come."""
    return run("completion", "words", "--", *words, **more).split()


def shown_on_terminal(*arguments, standard_output=False):
    """What somebody at a terminal sees on standard error, or on standard output."""
    terminal, theirs = pty.openpty()
    streams = {"stdout": theirs, "stderr": subprocess.DEVNULL} if standard_output else {"stdout": subprocess.DEVNULL, "stderr": theirs}
    with subprocess.Popen([RRGATE, *map(str, arguments)], **streams) as process:
        os.close(theirs)
        shown = b""
        with contextlib.suppress(OSError):  # it has ended
            while piece := os.read(terminal, 4096):
                shown += piece
        os.close(terminal)
    assert process.returncode == DONE, shown
    return shown.decode()
