"""Messages of version 4 with sizes and counts of entries and elements in five bytes each, as robotraconteurlite writes them: it leaves room
for them before it knows how large they become."""
import struct

TEXT, NUMBER, SIGNED, WORD = range(4)
ENTRY = ((0x01, TEXT), (0x02, NUMBER), (0x04, TEXT), (0x08, NUMBER), (0x10, NUMBER), (0x20, WORD), (0x40, TEXT), (0x80, TEXT))
ELEMENT_KEY = ((0x01, TEXT), (0x02, NUMBER), (0x04, SIGNED))
ELEMENT_TYPE = ((0x08, TEXT), (0x10, NUMBER), (0x20, TEXT), (0x80, TEXT))


def _number(data, at):
    """A uint_x, and where it ends."""
    wide = {0xfd: "<H", 0xfe: "<I"}.get(data[at])
    return (struct.unpack_from(wide, data, at + 1)[0], at + 1 + struct.calcsize(wide)) if wide else (data[at], at + 1)


def _long(number):
    return b"\xfe" + struct.pack("<I", number)


def _with_size(body):
    """The size counts itself."""
    return _long(len(body) + 5) + body


def _behind(data, at, flags, fields):
    for flag, kind in fields:
        if flags & flag and kind == TEXT:
            size, at = _number(data, at)
            at += size
        elif flags & flag and kind == NUMBER:
            at = _number(data, at)[1]
        elif flags & flag:
            at += 2 if kind == WORD else {0x7d: 3, 0x7e: 5}.get(data[at], 1)
    return at


def _lengthen_element(data, begin, end):
    body = _number(data, begin)[1]
    at = _behind(data, body + 1, data[body], ELEMENT_KEY) + 2
    at = _behind(data, at, data[body], ELEMENT_TYPE)
    count, values = _number(data, at)
    return _with_size(data[body:at] + _long(count) + data[values:end])


def _lengthen_entry(data, begin):
    """The entry, and where the short one ends."""
    size, body = _number(data, begin)
    at = _behind(data, body + 3, data[body], ENTRY)
    count, element = _number(data, at)
    out = data[body:at] + _long(count)
    for _ in range(count):
        end = element + _number(data, element)[0]
        out += _lengthen_element(data, element, end)
        element = end
    assert element == begin + size
    return _with_size(out), element


def lengthen(message):
    """A whole message; those of other versions as they are."""
    if struct.unpack_from("<H", message, 8)[0] != 4:
        return message
    at = _number(message, 10)[0]
    out = message[:at]
    while at < len(message):
        entry, at = _lengthen_entry(message, at)
        out += entry
    return out[:4] + struct.pack("<I", len(out)) + out[8:]


class Lengthened:
    """A stream of messages, in pieces."""

    def __init__(self):
        self._rest = b""

    def __call__(self, piece):
        self._rest += piece
        out = b""
        while len(self._rest) >= 8 and len(self._rest) >= (size := struct.unpack_from("<I", self._rest, 4)[0]):
            out, self._rest = out + lengthen(self._rest[:size]), self._rest[size:]
        return out
