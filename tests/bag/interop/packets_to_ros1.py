#!/usr/bin/python3
"""Captured packets of a VLP-16 as velodyne_msgs/VelodyneScan in a ROS 1 bag: packets_to_ros1.py PCAP BAG"""
import struct
import sys

import genpy
import genpy.dynamic
import rosbag

DEFINITION = f"""Header header
VelodynePacket[] packets
{"=" * 80}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
{"=" * 80}
MSG: velodyne_msgs/VelodynePacket
time stamp
uint8[1206] data
"""
PORT, PACKET_BYTES, PACKETS_PER_SCAN = 2368, 1206, 76


def packets(path):
    """(seconds, nanoseconds, payload) of the data packets in a pcap file."""
    with open(path, "rb") as capture:
        unit_ns = 1 if struct.unpack("<I", capture.read(24)[:4])[0] == 0xA1B23C4D else 1000
        while len(head := capture.read(16)) == 16:
            seconds, fraction, size, _ = struct.unpack("<IIII", head)
            frame = capture.read(size)
            udp = 14 + (frame[14] & 15) * 4
            payload = frame[udp + 8:]
            if frame[23] == 17 and frame[udp + 2:udp + 4] == PORT.to_bytes(2, "big") and len(payload) >= PACKET_BYTES:
                yield seconds, fraction * unit_ns, payload[:PACKET_BYTES]


def main():
    types = genpy.dynamic.generate_dynamic("velodyne_msgs/VelodyneScan", DEFINITION)
    captured = list(packets(sys.argv[1]))
    with rosbag.Bag(sys.argv[2], "w", compression="lz4") as bag:
        for first in range(0, len(captured), PACKETS_PER_SCAN):
            scan = types["velodyne_msgs/VelodyneScan"]()
            for seconds, nanoseconds, payload in captured[first:first + PACKETS_PER_SCAN]:
                packet = types["velodyne_msgs/VelodynePacket"]()
                packet.stamp, packet.data = genpy.Time(seconds, nanoseconds), payload
                scan.packets.append(packet)
            scan.header.stamp, scan.header.frame_id = scan.packets[0].stamp, "velodyne"
            bag.write("/velodyne_packets", scan, scan.packets[-1].stamp)


if __name__ == "__main__":
    main()
