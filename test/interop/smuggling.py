"""Requests that two readers may read differently: where one ends, and whether bytes behind it are another one. RFC 9112."""

TARGETS = ("/api/v1/access/requests", "/healthz")  # one route reads the body, the other leaves it

# What means one thing alone: it is answered, as one request.
PLAIN = {
    "a coding: an underscore, and a length", "a coding: in other letters", "a request line with another host",
    "a request line with a method in small letters", "a request line with a tab", "a request line with a blank before",
    "a request line with CONNECT", "an upgrade with a body", "chunks: an extension", "chunks: trailers that name a host",
    "headers: 1000 headers", "headers: Connection names the coding", "headers: Connection names the host",
    "headers: Connection names the length", "headers: an upgrade to HTTP/2", "headers: an expectation",
    "headers: an expectation that is none", *(f"{method} with a body" for method in ("GET", "HEAD", "OPTIONS", "DELETE", "TRACE", "FOO")),
}


def hidden(number):
    """A request that stands where it may be taken for none. The gateway's log names its origin once it is taken for one."""
    return f"GET /smuggled HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: {origin(number)}\r\n\r\n".encode()


def origin(number):
    return f"https://smuggled-{number}.example"


def post(headers, body, target=TARGETS[0], version="1.1"):
    return f"POST {target} HTTP/{version}\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n".encode() + headers + b"\r\n" + body


def get(headers=b"", line=b"GET /healthz HTTP/1.1"):
    return line + b"\r\nHost: 127.0.0.1\r\n" + headers + b"\r\n"


def attacks(number):
    """{name: bytes}. In each, the hidden request is a part of the body, or nothing, for one of two readings."""
    inner = hidden(number)
    size = len(inner)
    chunked, length = b"Transfer-Encoding: chunked\r\n", b"Content-Length: %d\r\n" % size
    end = b"0\r\n\r\n"
    in_chunk = b"%x\r\n%s\r\n%s" % (size, inner, end)
    out = {}
    for target in TARGETS:
        at = f" at {target}"
        out["Content-Length before Transfer-Encoding" + at] = \
            post(b"Content-Length: %d\r\n" % (size + len(end)) + chunked, end + inner, target)
        out["Transfer-Encoding before Content-Length" + at] = post(chunked + b"Content-Length: 4\r\n", in_chunk, target)
        out["two lengths, the first is 0" + at] = post(b"Content-Length: 0\r\n" + length, inner, target)
        out["two lengths, the last is 0" + at] = post(length + b"Content-Length: 0\r\n", inner, target)
        out["a list of lengths" + at] = post(b"Content-Length: 0, %d\r\n" % size, inner, target)
    for name, text in {
        "with a sign": b"+%d", "negative": b"-%d", "in hexadecimal": b"0x%x", "with a blank inside": b"0 %d", "with a comma behind": b"%d,",
        "too large for 64 bits": b"1844674407370955%d", "a text": b"many%d", "with a fraction": b"%d.0", "quoted": b'"%d"',
        "with NUL behind": b"%d\x00", "with a vertical tab before": b"\x0b%d",
    }.items():
        out[f"a length {name}"] = post(b"Content-Length: " + text % size + b"\r\n", inner)
    out["an empty length"] = post(b"Content-Length:\r\n", inner)
    for name, line in {
        "unknown": b"Transfer-Encoding: xchunked", "identity": b"Transfer-Encoding: identity", "two, chunked first": b"Transfer-Encoding: chunked, identity",
        "two, chunked last": b"Transfer-Encoding: identity, chunked", "twice chunked": b"Transfer-Encoding: chunked, chunked",
        "in two lines": b"Transfer-Encoding: chunked\r\nTransfer-Encoding: identity", "a blank before the colon": b"Transfer-Encoding : chunked",
        "a tab before the colon": b"Transfer-Encoding\t: chunked", "a vertical tab": b"Transfer-Encoding:\x0bchunked", "a NUL": b"Transfer-Encoding: chunked\x00",
        "quoted": b'Transfer-Encoding: "chunked"', "with a parameter": b"Transfer-Encoding: chunked;q=1", "a comma before": b"Transfer-Encoding: ,chunked",
        "empty": b"Transfer-Encoding:", "folded": b"Transfer-Encoding:\r\n chunked", "behind a bare LF": b"X-A: b\nTransfer-Encoding: chunked",
        "behind a bare CR": b"X-A: b\rTransfer-Encoding: chunked", "a blank line before": b" Transfer-Encoding: chunked", "an underscore": b"Transfer_Encoding: chunked",
        "a high byte": b"Transfer-Encoding: chunked\xa0", "in other letters": b"tRANSFER-eNCODING: cHUNKED",
    }.items():
        out[f"a coding: {name}, and a length"] = post(line + b"\r\nContent-Length: %d\r\n" % (size + len(end)), end + inner)
        if name != "an underscore":  # another header: no body is told of
            out[f"a coding: {name}"] = post(line + b"\r\n", b"%x\r\n%s\r\n%s" % (size, inner, end))
    for name, body in {
        "a size with 0x": b"0x%x\r\n%s\r\n" % (size, inner) + end, "a size with a sign": b"+%x\r\n%s\r\n" % (size, inner) + end,
        "a negative size": b"-1\r\n" + inner, "a size with a blank before": b" %x\r\n%s\r\n" % (size, inner) + end,
        "a size with an underscore": b"0_%x\r\n%s\r\n" % (size, inner) + end, "a size of 17 digits": b"F0000000000000%03x\r\n%s\r\n" % (size, inner) + end,
        "a size that wraps": b"100000000%08x\r\n%s\r\n" % (size, inner) + end, "no size": b"\r\n" + inner, "a size that is none": b"zz\r\n" + inner,
        "an extension with a bare LF": b"2;a\nxx\r\n%x\r\n%s\r\n" % (size, inner) + end, "an extension with a bare CR": b"2;a\rxx\r\n%x\r\n%s\r\n" % (size, inner) + end,
        "a size behind a bare LF": b"2\n{}\n0\n\n" + inner, "data longer than its size": b"2\r\n{}xx\r\n0\r\n\r\n" + inner,
        "data without its end": b"2\r\n{}0\r\n\r\n" + inner, "a wrong end of the data": b"2\r\n{}XX0\r\n\r\n" + inner,
        "a very long extension": b"2;" + b"a" * 100_000 + b"\r\n{}\r\n" + end,
    }.items():
        out[f"chunks: {name}"] = post(chunked, body)
    out["chunks: an extension"] = post(chunked, b"2;a=b\r\n{}\r\n0;c\r\n\r\n")
    out["chunks: trailers that name a length"] = post(chunked, b"2\r\n{}\r\n0\r\nContent-Length: %d\r\n\r\n" % size)
    out["chunks: trailers that name a host"] = post(chunked, b"2\r\n{}\r\n0\r\nHost: evil.example\r\nAuthorization: Basic eA==\r\n\r\n")
    out["chunks in HTTP/1.0"] = post(chunked, in_chunk, version="1.0")
    for name, lines in {
        "a blank before the colon of the length": b"Content-Length : %d\r\n" % size, "a folded length": b"Content-Length: 0\r\n %d\r\n" % size,
        "a folded header": b"X-A: b\r\n c: d\r\n", "a fold before all": b" X-A: b\r\n", "no colon": b"X-A\r\n", "no name": b": b\r\n", "a NUL in a value": b"X-A: \x00\r\n",
        "a NUL in a name": b"X\x00A: b\r\n", "a bare CR": b"X-A: b\rContent-Length: %d\r\n" % size, "a bare LF": b"X-A: b\nContent-Length: %d\r\n" % size,
        "two hosts": b"Host: evil.example\r\n", "a blank in a name": b"X A: b\r\n", "headers of 200 kB": b"X-A: " + b"a" * 200_000 + b"\r\n",
        "1000 headers": b"X-A: b\r\n" * 1000, "Connection names the length": b"Connection: close, Content-Length\r\n" + length,
        "Connection names the coding": b"Connection: keep-alive, Transfer-Encoding\r\n" + chunked, "Connection names the host": b"Connection: Host\r\n",
        "an upgrade to HTTP/2": b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\nHTTP2-Settings: AAMAAABk\r\n",
        "an expectation that is none": b"Expect: y 100-continue\r\n" + length, "an expectation": b"Expect: 100-continue\r\n" + length,
    }.items():
        out[f"headers: {name}"] = post(lines, inner) if b"ength" in lines or b"Expect" in lines else \
            post(lines, in_chunk) if b"chunked" in lines else get(lines)
    for name, line in {
        "another host": b"GET http://evil.example/healthz HTTP/1.1", "a blank too many": b"GET  /healthz HTTP/1.1", "a tab": b"GET\t/healthz HTTP/1.1",
        "words behind": b"GET /healthz HTTP/1.1 x", "HTTP/1.10": b"GET /healthz HTTP/1.10", "HTTP/2.0": b"GET /healthz HTTP/2.0", "HTTP/0.9": b"GET /healthz",
        "no version": b"GET /healthz HTTP/", "a NUL": b"GET /heal\x00thz HTTP/1.1", "a blank before": b" GET /healthz HTTP/1.1", "CONNECT": b"CONNECT 127.0.0.1:80 HTTP/1.1",
        "a method in small letters": b"get /healthz HTTP/1.1", "a bare LF": b"GET /healthz HTTP/1.1\nX-A: b", "100 kB": b"GET /" + b"a" * 100_000 + b" HTTP/1.1",
    }.items():
        out[f"a request line with {name}"] = get(line=line)
    for method in (b"GET", b"HEAD", b"OPTIONS", b"DELETE", b"TRACE", b"FOO"):
        out[f"{method.decode()} with a body"] = get(length, method + b" /healthz HTTP/1.1") + inner
    out["an upgrade with a body"] = get(b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                        b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" + length, b"GET /devices/nothing HTTP/1.1") + inner
    out["line ends without CR"] = post(length, inner).replace(b"\r\n", b"\n", 4)
    return out
