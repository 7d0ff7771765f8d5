"""A keyframer in Python: each scan with enough landmarks becomes a keyframe. Run it instead of
understory-keyframer; the channels are the only interface. Keyframes of one scan need
`min_observations = 1` in [smoothing] of geoslam_mapper.toml.

    understory launch --only NAME ...    (all processes but keyframer)
    python3 keyframer.py [URL]
"""

import os
import sys
import time

import understory as types
from understory import bus

LEAST_LANDMARKS = 6


def keyframe_of(scan, number):
    keyframe = types.keyframe2_t()
    keyframe.utime, keyframe.seq = scan.utime, number
    keyframe.max_range_m, keyframe.bearing_rad, keyframe.width_rad = scan.max_range_m, scan.bearing_rad, scan.width_rad
    # The only member is the base, and the landmarks' frame is the vehicle's: exact, except for a millimetre.
    base = types.keyframe_member_t()
    base.utime, base.seq = scan.utime, scan.seq
    base.covariance = [[1e-6 if row == column else 0.0 for column in range(3)] for row in range(3)]
    keyframe.num_members, keyframe.members = 1, [base]
    for index, detection in enumerate(scan.detections):
        landmark = types.keyframe_landmark_t()
        landmark.position_m = detection.position_m[:2]
        landmark.covariance_m2 = [row[:2] for row in detection.covariance_m2[:2]]
        landmark.radius_m, landmark.kind, landmark.times_seen = detection.radius_m, detection.kind, 1
        keyframe.landmarks.append(landmark)
        source = types.keyframe_detection_t()
        source.member, source.detection, source.landmark = 0, index, index
        keyframe.detections.append(source)
    keyframe.num_landmarks = keyframe.num_detections = len(scan.detections)
    return keyframe


def main():
    stage = bus.Bus(sys.argv[1]) if len(sys.argv) > 1 else bus.Bus()
    sent = 0

    def take(_, scan):
        nonlocal sent
        if isinstance(scan, types.landmarks_t) and scan.num_detections >= LEAST_LANDMARKS:
            stage.publish("KEYFRAME", keyframe_of(scan, sent))
            sent += 1

    stage.subscribe("LANDMARKS", take)
    health = types.health_t()
    health.process, health.version, health.pid, health.state = "keyframer", "python", os.getpid(), types.health_t.STATE_OK
    health.message_utime = health.snapshot_utime = health.last_error_utime = -1
    while True:  # HEALTH each second, so that `understory status` shows it.
        stage.run(for_s=1.0)
        health.utime, health.handled = int(time.time() * 1e6), sent
        stage.publish("HEALTH", health)
        health.seq += 1


if __name__ == "__main__":
    main()
