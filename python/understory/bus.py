"""The live bus: LCM over UDP multicast, without an LCM library.

    stage = bus.Bus()
    stage.subscribe("LANDMARKS", lambda channel, message: ...)
    stage.run()

Like every process of understory it stays on this computer (TTL 0) unless `ttl` says otherwise.
"""

import re
import select
import socket
import struct
import time
from urllib.parse import parse_qs, urlparse

from understory import messages

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"

_SHORT = struct.Struct(">II")  # magic, sequence
_FRAGMENT = struct.Struct(">IIIIHH")  # magic, sequence, bytes in all, offset, fragment, fragments
_MAGIC_SHORT = 0x4C433032
_MAGIC_FRAGMENT = 0x4C433033
_DATAGRAM_BYTES = 1400
_MOST_MESSAGE_BYTES = 1 << 28
_MOST_OPEN = 64  # messages with missing fragments
_BUFFER_BYTES = 4 << 20


def is_bulk(channel):
    """Whether a channel uses the second multicast group (sweeps)."""
    return channel.startswith(("RAW_SWEEP", "LIDAR_SWEEP"))


def _groups(url):
    """(address, port) of the first group and of the group for sweeps, and the TTL."""
    parts = urlparse(url)
    if parts.scheme != "udpm" or not parts.hostname or not parts.port:
        raise ValueError(f"{url}: not of the form udpm://ADDRESS:PORT?ttl=N")
    try:
        ttl = int(parse_qs(parts.query).get("ttl", ["0"])[0])
        first = socket.inet_aton(parts.hostname)[0]
    except (ValueError, OSError):
        raise ValueError(f"{url}: neither an address of four numbers nor a TTL") from None
    if not 224 <= first <= 239 or not 0 <= ttl <= 255:
        raise ValueError(f"{url}: no multicast group (224.0.0.0 to 239.255.255.255), or no TTL of 0 to 255")
    front, last = parts.hostname.rsplit(".", 1)
    beside = int(last) + 1 if int(last) < 255 else int(last) - 1
    bulk_port = parts.port + 1 if parts.port < 65535 else parts.port - 1
    return (parts.hostname, parts.port), (f"{front}.{beside}", bulk_port), ttl


class _Fragments:
    """Reassembly of messages from fragments."""

    def __init__(self):
        self._open = {}

    def add(self, sender, datagram):
        """(channel, data) if this datagram completes a message, else None."""
        _, sequence, size, offset, number, count = _FRAGMENT.unpack_from(datagram)
        if size > _MOST_MESSAGE_BYTES or number >= count:
            return None
        rest = datagram[_FRAGMENT.size :]
        key = (sender, sequence)
        channel, data, missing = self._open.get(key, (None, None, None))
        if data is None or len(data) != size:
            channel, data, missing = None, bytearray(size), set(range(count))
        if number == 0:
            name, _, rest = rest.partition(b"\0")
            channel = name.decode("utf-8", "replace")
        if offset + len(rest) > size:
            return None
        data[offset : offset + len(rest)] = rest
        missing.discard(number)
        if not missing:
            self._open.pop(key, None)
            return channel, bytes(data)

        self._open[key] = (channel, data, missing)
        while len(self._open) > _MOST_OPEN:
            self._open.pop(next(iter(self._open)))
        return None


class Bus:
    """Both groups of the bus. `damaged` counts messages of a known type that could not be decoded.

    Raises ValueError for a URL of another form, OSError if the group cannot be joined.
    """

    def __init__(self, url=DEFAULT_URL):
        self._group, self._bulk, ttl = _groups(url)
        self._handlers = []
        self._fragments = _Fragments()
        self._sequence = 0
        self.damaged = 0
        self._sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
        self._sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
        self._receivers = {}

    def subscribe(self, channels, handler):
        """`handler(channel, message)` for each message of the channels: a regular expression that
        matches a whole name. Messages of other types come as bytes. In order of subscription."""
        self._handlers.append((re.compile(channels), handler))
        for group in self._needed_groups(channels):
            if group not in self._receivers:
                self._receivers[group] = self._join(group)

    def _needed_groups(self, channels):
        """A plain name needs only one group; sweeps are most of all bytes."""
        if re.fullmatch(r"\w+", channels):
            return [self._bulk if is_bulk(channels) else self._group]
        return [self._group, self._bulk]

    @staticmethod
    def _join(group):
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        receiver.bind(group)
        membership = socket.inet_aton(group[0]) + struct.pack("=I", socket.INADDR_ANY)
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        return receiver

    def publish(self, channel, message):
        """Sends a message of understory's types, or bytes."""
        data = message if isinstance(message, (bytes, bytearray)) else message.encode()
        name = channel.encode() + b"\0"
        group = self._bulk if is_bulk(channel) else self._group
        if len(name) + len(data) <= _DATAGRAM_BYTES:
            self._sender.sendto(_SHORT.pack(_MAGIC_SHORT, self._sequence) + name + bytes(data), group)
        else:
            self._send_fragments(group, name, bytes(data))
        self._sequence = (self._sequence + 1) & 0xFFFFFFFF

    def _send_fragments(self, group, name, data):
        first = _DATAGRAM_BYTES - len(name)
        starts = [0, *range(first, len(data), _DATAGRAM_BYTES)]
        if len(starts) > 0xFFFF:
            raise ValueError(f"a message of {len(data)} bytes is too large for the bus")
        ends = [*starts[1:], len(data)]
        for number, (start, end) in enumerate(zip(starts, ends)):
            header = _FRAGMENT.pack(_MAGIC_FRAGMENT, self._sequence, len(data), start, number, len(starts))
            self._sender.sendto(header + (name if number == 0 else b"") + data[start:end], group)

    def handle(self, timeout_s=1.0):
        """Waits for one datagram and passes a completed message to its handlers. False if none arrived in time."""
        ready, _, _ = select.select(list(self._receivers.values()), [], [], timeout_s)
        if not ready:
            return False
        for receiver in ready:
            datagram, sender = receiver.recvfrom(65536)
            found = self._message_of(sender, datagram)
            if found is not None:
                self._hand_out(*found)
        return True

    def _message_of(self, sender, datagram):
        if len(datagram) < _SHORT.size:
            return None
        magic = _SHORT.unpack_from(datagram)[0]
        if magic == _MAGIC_SHORT:
            name, _, data = datagram[_SHORT.size :].partition(b"\0")
            return name.decode("utf-8", "replace"), data
        if magic == _MAGIC_FRAGMENT and len(datagram) >= _FRAGMENT.size:
            return self._fragments.add(sender, datagram)
        return None

    def _hand_out(self, channel, data):
        wanted = [handler for channels, handler in self._handlers if channels.fullmatch(channel)]
        if not wanted:
            return
        try:
            message = messages.decode(data)
        except ValueError:
            self.damaged += 1
            return
        for handler in wanted:
            handler(channel, data if message is None else message)

    def run(self, for_s=None):
        """Passes messages to their handlers for `for_s` seconds; forever if it is None."""
        end = None if for_s is None else time.monotonic() + for_s
        while end is None or time.monotonic() < end:
            self.handle(0.1 if end is None else max(0.0, min(0.1, end - time.monotonic())))

    def close(self):
        """Leaves the groups."""
        self._sender.close()
        for receiver in self._receivers.values():
            receiver.close()
