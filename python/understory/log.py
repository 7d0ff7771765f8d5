"""LCM logs: read and written without an LCM library.

    for event in log.read("drive.lcm", channels=["SLAM_POSE"]):
        print(event.utime, event.message.submap_T_vehicle.x)
"""

import re
import struct
from typing import NamedTuple, Optional

from understory import messages

# Sync word, event number, receive time [us], bytes of the channel and of the data; big endian.
_HEADER = struct.Struct(">IqqII")
_SYNC = 0xEDA1DA01
_SYNC_BYTES = struct.pack(">I", _SYNC)
_MOST_CHANNEL_BYTES = 1000
_MOST_DATA_BYTES = 1 << 28
_SEARCH_BYTES = 1 << 20


class LogError(ValueError):
    """A log that cannot be read; the text has the file and the position."""


class Event(NamedTuple):
    """One message of a log."""

    number: int  #: Counts the events of the log from 0.
    utime: int  #: When it was received [us]; the measurement's own time is in the message.
    channel: str
    data: bytes

    @property
    def message(self):
        """The decoded message; None if it has none of understory's types. Raises ValueError if it is
        damaged."""
        return messages.decode(self.data)


class Log:
    """An LCM log, read from the start each time it is iterated over.

    `channels`: names or regular expressions that match a whole name; None = all. Damaged parts are
    skipped; `damaged_bytes` is their size, including an event truncated at the end of the file.
    Raises LogError for a file that cannot be opened or is no LCM log. Memory: one event.
    """

    def __init__(self, path, channels=None):
        self.path = str(path)
        self.damaged_bytes = 0
        self._wanted = None if channels is None else [re.compile(one) for one in channels]

    def __iter__(self):
        self.damaged_bytes = 0
        try:
            file = open(self.path, "rb")
        except OSError as error:
            raise LogError(f"{self.path}: {error.strerror}") from error
        with file:
            yield from self._events(file)

    def _events(self, file):
        good_until = 0
        is_first = True
        while True:
            event = self._next(file)
            if event is not None:
                good_until = file.tell()
                is_first = False
                if self._is_wanted(event.channel):
                    yield event
                continue

            next_sync = self._find_sync(file, good_until + (1 if file.tell() > good_until else 0))
            if next_sync is None:
                file.seek(0, 2)
                self.damaged_bytes += file.tell() - good_until
                if is_first and file.tell() > 0:
                    raise LogError(f"{self.path}: no LCM log")
                return
            self.damaged_bytes += next_sync - good_until
            good_until = next_sync
            file.seek(next_sync)

    def _is_wanted(self, channel):
        return self._wanted is None or any(one.fullmatch(channel) for one in self._wanted)

    @staticmethod
    def _next(file):
        """The event at this position; None if there is none."""
        header = file.read(_HEADER.size)
        if len(header) < _HEADER.size:
            return None
        sync, number, utime, channel_bytes, data_bytes = _HEADER.unpack(header)
        is_event = sync == _SYNC and 0 < channel_bytes <= _MOST_CHANNEL_BYTES and data_bytes <= _MOST_DATA_BYTES
        if not is_event:
            return None
        channel = file.read(channel_bytes)
        data = file.read(data_bytes)
        if len(channel) < channel_bytes or len(data) < data_bytes:
            return None
        return Event(number, utime, channel.decode("utf-8", "replace"), data)

    @staticmethod
    def _find_sync(file, start) -> Optional[int]:
        """Position of the next sync word at or after `start`."""
        file.seek(start)
        kept = b""
        while True:
            chunk = file.read(_SEARCH_BYTES)
            if not chunk:
                return None
            text = kept + chunk
            at = text.find(_SYNC_BYTES)
            if at >= 0:
                return start + at
            kept = text[-3:]
            start += len(text) - len(kept)


def read(path, channels=None):
    """The events of a log in their order; see Log."""
    return iter(Log(path, channels))


class LogWriter:
    """Writes an LCM log; use it in a `with`. Raises OSError."""

    def __init__(self, path):
        self._file = open(path, "wb")
        self._number = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._file.close()

    def write(self, utime, channel, message):
        """Writes one event. `message`: of one of understory's types, or bytes."""
        data = message if isinstance(message, (bytes, bytearray)) else message.encode()
        name = channel.encode()
        self._file.write(_HEADER.pack(_SYNC, self._number, utime, len(name), len(data)) + name + data)
        self._number += 1
