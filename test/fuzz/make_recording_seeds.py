#!/usr/bin/env python3
"""First inputs of the fuzzer of recordings, the beginnings of recorded ones: make_recording_seeds.py DIRECTORY

Chunks have no CRC, so that what is changed in them is read."""
import pathlib
import struct
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
MAGIC = b"\x89MCAP0\r\n"
CHANNEL, CHUNK, METADATA, DATA_END, FOOTER = 4, 6, 0xC, 0xF, 2
MESSAGES = 3


def records(data, at=0):
    while at + 9 <= len(data):
        opcode, length = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        yield opcode, data[at + 9:at + 9 + length]
        at += 9 + length


def record(opcode, content):
    return bytes([opcode]) + struct.pack("<Q", len(content)) + content


def texts_of(content, at):
    """{key: (where its text begins, text)} of the map at the end of a record."""
    at += 4
    while at < len(content):
        pair = []
        for _ in range(2):
            size = struct.unpack_from("<I", content, at)[0]
            pair.append(content[at + 4:at + 4 + size])
            at += 4 + size
        yield pair


def text(value):
    return struct.pack("<I", len(value)) + value


def without_definitions(content):
    """A service whose types nobody asks for: a tenth of the size."""
    name = struct.unpack_from("<I", content)[0] + 4
    pairs = [(key, b"[]" if key == b"definitions" else value) for key, value in texts_of(content, name)]
    return content[:name] + text(b"".join(text(key) + text(value) for key, value in pairs))


def first_messages(chunk):
    """The chunk with its first messages alone."""
    begin, end = struct.unpack_from("<QQ", chunk)
    compression = 28 + 4 + struct.unpack_from("<I", chunk, 28)[0]
    inside = b"".join(record(*each) for each in list(records(chunk[compression + 8:]))[:MESSAGES])
    return struct.pack("<QQQI", begin, end, len(inside), 0) + text(b"") + struct.pack("<Q", len(inside)) + inside


def beginning(data, chunks):
    out = MAGIC
    for opcode, content in records(data, len(MAGIC)):
        if opcode == CHUNK:
            if chunks == 0:
                break
            chunks -= 1
            out += record(opcode, first_messages(content))
        elif opcode == METADATA:
            out += record(opcode, without_definitions(content))
        elif opcode in (1, CHANNEL):
            out += record(opcode, content)
    return out


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for path in sorted(ROOT.glob("test/golden/recordings/*.mcap")):
        data = path.read_bytes()
        for chunks in range(3):
            begin = beginning(data, chunks)
            (target / f"{path.stem}-{chunks}").write_bytes(begin + record(DATA_END, bytes(4)) + record(FOOTER, bytes(20)) + MAGIC)
        (target / f"{path.stem}-cut").write_bytes(begin[:-40])
