#!/usr/bin/python3
"""A log of Understory as a ROS 1 bag: log_to_ros1.py LOG BAG PACKING SECONDS TYPES

TYPES: a folder with the types that lcm-gen -p made. Bags of other packings have the same messages.
"""
import math
import struct
import sys

import genpy
import numpy as np
import rosbag
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, NavSatFix, PointCloud2, PointField
from tf2_msgs.msg import TFMessage

LATITUDE, LONGITUDE, EARTH_M, WHEELBASE_M = 48.0, 9.0, 6378137.0, 2.7
POINT = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("t", "<u4"), ("ring", "<u2")])
FIELDS = [PointField(name, offset, kind, 1) for name, offset, kind in
          [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("t", 16, 6), ("ring", 20, 4)]]


def events(path):
    """(time [us], channel, bytes) of a log."""
    with open(path, "rb") as log:
        while len(head := log.read(28)) == 28:
            _, _, time, channel, data = struct.unpack(">IqqII", head)
            yield time, log.read(channel).decode(), log.read(data)


def at(utime):
    return genpy.Time(utime // 1000000, utime % 1000000 * 1000) if utime else genpy.Time(0, 1)


def headed(message, utime, frame):
    message.header.stamp = genpy.Time(utime // 1000000, utime % 1000000 * 1000)
    message.header.frame_id = frame
    return message


def mount(frame, x, y, z):
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = "base_link", frame
    translation = transform.transform.translation
    translation.x, translation.y, translation.z = x, y, z
    transform.transform.rotation.w = 1.0
    return transform


def cloud(parts):
    arrays = []
    for part in parts:
        points = np.zeros(part.num_points, POINT)
        for name in "xyz":
            points[name] = np.array(getattr(part, name), float) * part.resolution_m
        points["t"] = np.rint(np.array(part.time, float) * part.time_step_s * 1e9)
        points["ring"] = np.frombuffer(bytes(part.ring), np.uint8)
        points["intensity"] = np.frombuffer(bytes(part.intensity), np.uint8)
        arrays.append(points)
    points = np.concatenate(arrays)
    # The parts of a sweep round their times to steps of their own: at a seam they may run back.
    points["t"] = np.maximum.accumulate(points["t"])
    message = headed(PointCloud2(), parts[0].utime, "velodyne")
    message.height, message.width, message.fields = 1, len(points), FIELDS
    message.point_step, message.row_step = POINT.itemsize, POINT.itemsize * len(points)
    message.is_dense, message.data = True, points.tobytes()
    return message


def imu(sample):
    message = headed(Imu(), sample.utime, "imu_link")
    message.orientation_covariance[0] = -1
    rate, force = message.angular_velocity, message.linear_acceleration
    rate.x, rate.y, rate.z = sample.angular_rate_rad_s
    force.x, force.y, force.z = sample.specific_force_m_s2
    return message


def odometry(wheels):
    message = headed(Odometry(), wheels.utime, "odom")
    message.child_frame_id = "base_link"
    message.pose.pose.orientation.w = 1
    message.twist.twist.linear.x = wheels.speed_m_s
    message.twist.twist.angular.z = wheels.speed_m_s * math.tan(wheels.steering_rad) / WHEELBASE_M
    return message


def fix(gnss):
    message = headed(NavSatFix(), gnss.utime, "gnss")
    message.status.status = 0 if gnss.valid else -1
    message.latitude = LATITUDE + math.degrees(gnss.north_m / EARTH_M)
    message.longitude = LONGITUDE + math.degrees(gnss.east_m / (EARTH_M * math.cos(math.radians(LATITUDE))))
    variance = gnss.sigma_m ** 2
    message.position_covariance = [variance, 0, 0, 0, variance, 0, 0, 0, 1]
    message.position_covariance_type = 2
    return message


def reference(truth):
    message = headed(PoseStamped(), truth.utime, "map")
    pose = truth.world_T_vehicle
    message.pose.position.x, message.pose.position.y = pose.x, pose.y
    message.pose.orientation.z, message.pose.orientation.w = math.sin(pose.theta / 2), math.cos(pose.theta / 2)
    return message


def main():
    log, path, packing, seconds, types = sys.argv[1:]
    sys.path.insert(0, types)
    from understory.gnss_t import gnss_t
    from understory.ground_truth_t import ground_truth_t
    from understory.imu_t import imu_t
    from understory.lidar_sweep_t import lidar_sweep_t
    from understory.wheels_t import wheels_t
    small = {"RAW_IMU": ("/imu", imu_t, imu), "RAW_WHEELS": ("/odom", wheels_t, odometry),
             "RAW_GNSS": ("/fix", gnss_t, fix), "GROUND_TRUTH": ("/truth", ground_truth_t, reference)}
    parts = []
    with rosbag.Bag(path, "w", compression=packing) as bag:
        bag.write("/tf_static", TFMessage([mount("velodyne", 1.2, 0, 1.9), mount("imu_link", 1.0, 0, 0.6)]), at(0))
        for time, channel, data in events(log):
            if time > float(seconds) * 1e6:
                break
            if channel == "RAW_SWEEP":
                parts.append(lidar_sweep_t.decode(data))
                if parts[-1].part == parts[-1].parts - 1:
                    bag.write("/points", cloud(parts), at(time))
                    parts = []
            elif channel in small:
                topic, kind, convert = small[channel]
                bag.write(topic, convert(kind.decode(data)), at(time))


if __name__ == "__main__":
    main()
