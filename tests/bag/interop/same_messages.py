#!/usr/bin/python3
"""Do two logs have the same bytes on these channels? same_messages.py LOG LOG CHANNEL..."""
import struct
import sys


def channels(path):
    found = {}
    with open(path, "rb") as log:
        while len(head := log.read(28)) == 28:
            _, _, _, channel, data = struct.unpack(">IqqII", head)
            found.setdefault(log.read(channel).decode(), []).append(log.read(data))
    return found


first, second = channels(sys.argv[1]), channels(sys.argv[2])
differ = False
for name in sys.argv[3:]:
    one, two = first.get(name, []), second.get(name, [])
    same = sum(a == b for a, b in zip(one, two))
    differ |= not one or one != two
    print(f"{name}: {len(one)} and {len(two)} messages, {same} with the same bytes")
sys.exit(differ)
