"""A TCP forwarder that remembers the bytes, to see what two peers have agreed on, and may change what the client says."""
import contextlib
import socket
import struct
import threading


class Tap:
    def __init__(self, port, change=bytes, make_answers=lambda: bytes):
        """`change` makes of a piece of what the client sends what the service gets; what `make_answers` makes for each
        connection does the same the other way."""
        self._change = change
        self._make_answers = make_answers
        self._target = ("127.0.0.1", port)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.streams = []  # one bytearray for each direction of each connection
        self._sockets = []
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        self._listener.close()

    def lead_to(self, port):
        """Where new connections go: a service of the reference that is started again may not get its port back."""
        self._target = ("127.0.0.1", port)

    def cut(self):
        """Ends what is connected; new connections are let through."""
        for each in self._sockets:
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
        self._sockets.clear()

    def _accept(self):
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            try:
                service = socket.create_connection(self._target)
            except OSError:  # nobody there
                client.close()
                continue
            self._sockets += [client, service]
            for source, sink, change in ((client, service, self._change), (service, client, self._make_answers())):
                stream = bytearray()
                self.streams.append(stream)
                threading.Thread(target=forward, args=(source, sink, stream, change), daemon=True).start()

    def level(self):
        """"v2", "v4" or "v4+table": what the messages after the handshake are."""
        seen = {message_level(message) for stream in self.streams for message in messages(bytes(stream))}
        return max(seen, default=None)


class Held:
    """A line on which messages of the service with some text in them wait, while `is_on`, until something comes after that."""

    def __init__(self, text):
        self._text = text
        self.is_on = False
        self.messages = []

    def line(self, port):
        return Tap(port, make_answers=self._make_answers)

    def _make_answers(self):
        rest = bytearray()

        def change(data):
            rest.extend(data)
            passed = b""
            for message in messages(bytes(rest)):
                del rest[:len(message)]
                if self.is_on and self._text in message:
                    self.messages.append(message)
                else:
                    passed += message
            if not self.is_on:
                passed = b"".join(self.messages) + passed
                self.messages.clear()
            return passed
        return change


def forward(source, sink, stream, change):
    try:
        while data := source.recv(65536):
            stream += data
            sink.sendall(change(data))
        sink.shutdown(socket.SHUT_WR)
    except OSError:
        pass


def messages(stream):
    while len(stream) >= 10:
        magic, size = stream[:4], struct.unpack_from("<I", stream, 4)[0]
        assert magic == b"RRAC", f"not a message: {stream[:16].hex()}"
        if len(stream) < size:
            return
        yield stream[:size]
        stream = stream[size:]


def message_level(message):
    version = struct.unpack_from("<H", message, 8)[0]
    if version == 2:
        return "v2"
    header_size, width = read_uint(message, 10)
    flags = message[10 + width]
    has_local_table = flags & 0x20
    _, width = read_uint(message, header_size)  # size of the first entry
    has_coded_names = message[header_size + width] & 0x0A if header_size < len(message) else 0
    return "v4+table" if has_local_table or has_coded_names else "v4"


def read_uint(data, offset):
    """A uint_x: one byte up to 252, then markers for 2, 4 and 8 bytes."""
    first = data[offset]
    if first <= 252:
        return first, 1
    size = {253: 2, 254: 4, 255: 8}[first]
    return int.from_bytes(data[offset + 1 : offset + 1 + size], "little"), 1 + size
