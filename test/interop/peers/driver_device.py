"""The kernel driver of a device that has a character device of its own: driver_device.py PORT

A pseudo-terminal is the character device; who opens it talks to 127.0.0.1:PORT, through a connection that ends when it is
closed. Prints the terminal's path, then a line whenever one that had it open has closed it. Runs until killed.
"""
import errno
import os
import selectors
import socket
import sys
import termios
import time
import tty


def make_terminal():
    driver, host = os.openpty()
    tty.setraw(host)  # and so it stays while the driver's end is open
    path = os.ttyname(host)
    os.close(host)
    os.set_blocking(driver, False)
    return driver, path


def read(driver):
    """Bytes; b"" when there are none yet; None while nobody has it open."""
    try:
        return os.read(driver, 65536)
    except BlockingIOError:
        return b""
    except OSError as error:
        if error.errno != errno.EIO:
            raise
        return None


def write(driver, data):
    while data:
        try:
            data = data[os.write(driver, data):]
        except BlockingIOError:
            time.sleep(0.001)


def carry(driver, first, port):
    """One stream, from its first bytes to its end on either side."""
    with socket.create_connection(("127.0.0.1", port)) as service, selectors.DefaultSelector() as selector:
        service.sendall(first)
        selector.register(driver, selectors.EVENT_READ)
        selector.register(service, selectors.EVENT_READ)
        while True:
            for key, _ in selector.select():
                if key.fileobj is service:
                    data = service.recv(65536)
                    if not data:
                        return
                    write(driver, data)
                else:
                    data = read(driver)
                    if data is None:
                        return
                    service.sendall(data)


driver, path = make_terminal()
print(path, flush=True)
while True:
    data = read(driver)
    if data:
        carry(driver, data, int(sys.argv[1]))
        while read(driver) is not None:  # the service may have ended it; the next who opens it begins anew
            time.sleep(0.005)
        termios.tcflush(driver, termios.TCIOFLUSH)
        print("closed", flush=True)
    else:
        time.sleep(0.005)
