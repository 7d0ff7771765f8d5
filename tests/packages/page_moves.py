#!/usr/bin/env python3
"""Waits until the viewer's page shows a vehicle that moves: its files are served and its WebSocket sends poses that are 2 m apart.

  page_moves.py PORT SECONDS     exit status 1 where that does not happen within SECONDS
"""
import base64
import json
import math
import os
import socket
import struct
import sys
import time
import urllib.request

MOVED_M = 2.0


def page(port):
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=2) as answer:
        return b"<html" in answer.read().lower()


def frames(port):
    """The headers of the frames that the page gets (services/viewer/protocol.md), acknowledged as the page does."""
    with socket.create_connection(("127.0.0.1", port), timeout=5) as link:
        stream = link.makefile("rb")
        key = base64.b64encode(os.urandom(16)).decode()
        link.sendall((f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                      f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n").encode())
        if b"101" not in stream.readline():
            raise OSError("no WebSocket")
        while stream.readline().strip():
            pass
        payload = b""
        while True:
            kind, size = stream.read(2)
            size &= 0x7F
            if size > 125:
                size = int.from_bytes(stream.read(2 if size == 126 else 8), "big")
            # The message continues in the next frame (0) until the one with the highest bit.
            payload = (payload if kind & 0x0F == 0 else b"") + stream.read(size)
            if kind & 0x80 == 0 or kind & 0x0F not in (0, 2):
                continue
            header = json.loads(payload[4:4 + struct.unpack("<I", payload[:4])[0]])
            if header.get("kind") == "frame":
                told = json.dumps({"ack": header["seq"], "shown_ms": int(time.time() * 1000)}).encode()
                # Masked with zeros, as clients must; below 126 bytes.
                link.sendall(bytes([0x81, 0x80 | len(told)]) + bytes(4) + told)
                yield header


def moved(port):
    first = None
    for header in frames(port):
        if "pose" not in header:
            continue
        here = header["pose"]["x"], header["pose"]["y"]
        first = first or here
        if math.dist(first, here) > MOVED_M:
            return here


def main():
    port, end = int(sys.argv[1]), time.monotonic() + float(sys.argv[2])
    trouble = None
    while time.monotonic() < end:
        try:
            if page(port):
                x, y = moved(port)
                print(f"the page shows a vehicle that moves, now at ({x:.1f}, {y:.1f}) m")
                return 0
        except (OSError, ValueError) as error:
            trouble = error
        time.sleep(0.2)
    print(f"no vehicle moves on the page: {trouble}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
