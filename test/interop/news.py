"""What goes on beside a test, in threads: what comes by itself, and load."""
import concurrent.futures
import contextlib
import threading

PATIENCE = 20.0  # seconds for what has to come by itself


class News:
    """What came by itself, to be waited for."""

    def __init__(self):
        self._changed = threading.Condition()
        self._all = []

    def add(self, item):
        with self._changed:
            self._all.append(item)
            self._changed.notify_all()

    def all(self):
        with self._changed:
            return list(self._all)

    def wait_for(self, is_it):
        with self._changed:
            assert self._changed.wait_for(lambda: any(is_it(item) for item in self._all), PATIENCE), self._all[-5:]


@contextlib.contextmanager
def under_load(exchange, threads=3):
    """Threads that call exchange() again and again, before, while and after what is done within: each call has to succeed."""
    ended = threading.Event()
    begun = [threading.Event() for _ in range(threads)]

    def repeat(has_begun):
        try:
            exchange()
        finally:
            has_begun.set()
        while not ended.is_set():
            exchange()
        exchange()

    with concurrent.futures.ThreadPoolExecutor(threads) as pool:
        loads = [pool.submit(repeat, each) for each in begun]
        try:
            assert all(each.wait(PATIENCE) for each in begun)
            yield
        finally:
            ended.set()
        for load in loads:
            load.result()
