"""Strangers at many addresses: flood.py PORT CONNECTIONS ADDRESSES. Each says one of the things below, and then nothing; who is
sent away comes again. Prints a line when so many have come, and goes on until its input ends."""
import base64
import errno
import os
import random
import selectors
import socket
import ssl
import sys

PORT, CONNECTIONS, ADDRESSES = (int(each) for each in sys.argv[1:4])
CHANCE = random.Random(1)


def client_hello():
    """What a client of TLS says first."""
    said = ssl.MemoryBIO()
    context = ssl.create_default_context()
    try:
        context.wrap_bio(ssl.MemoryBIO(), said, server_hostname="localhost").do_handshake()
    except ssl.SSLWantReadError:
        return said.read()


KINDS = (
    b"",
    b"GET /api/v1/devices HTTP/1.1\r\nHost: localhost\r\nX-",
    b"GET / HTTP/1.1\r\nHost: localhost\r\n" + b"X-Header: " + b"a" * 7000,
    b"POST /api/v1/devices/interop/interop/echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    b"Content-Length: 1000000\r\n\r\n" + b" " * 8000,
    b"GET /devices/interop?service=interop HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    b"Sec-WebSocket-Protocol: robotraconteur.robotraconteur.com\r\n\r\n\x82\xfe\x10\x00",
    b"RRAC\x00\x00\x10\x00\x02\x00" + b"\x00" * 6000,
    b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n" * 50,
    bytes(CHANCE.randrange(256) for _ in range(2000)),
    client_hello(),
    client_hello()[:-20],
    b"GET /api/v1/devices HTTP/1.1\r\nHost: localhost\r\nAuthorization: Basic " + base64.b64encode(b"alice:wrong") + b"\r\n\r\n",
)

chosen = selectors.DefaultSelector()
chosen.register(sys.stdin, selectors.EVENT_READ)
opened = 0


def come(number):
    link = socket.socket()
    link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    link.setblocking(False)
    link.bind((f"127.0.1.{1 + number % ADDRESSES}", 0))
    if link.connect_ex(("127.0.0.1", PORT)) in (0, errno.EINPROGRESS):
        chosen.register(link, selectors.EVENT_WRITE, number)
    else:
        link.close()


waiting = list(range(CONNECTIONS))
while True:
    for number in waiting[:200]:
        come(number)
        opened += 1
        if opened == CONNECTIONS:
            print("all have come", flush=True)
    del waiting[:200]
    for key, events in chosen.select(0.05):
        if key.fileobj is sys.stdin:
            os._exit(0)
        try:
            if events & selectors.EVENT_WRITE:
                key.fileobj.send(KINDS[key.data % len(KINDS)])
                chosen.modify(key.fileobj, selectors.EVENT_READ, key.data)
            elif not key.fileobj.recv(512):
                raise ConnectionError
        except BlockingIOError:
            pass
        except OSError:
            chosen.unregister(key.fileobj)
            key.fileobj.close()
            waiting.append(key.data)
