"""The results in a log of a drive as numpy arrays: poses, truth, the map, health.

    drive = Drive("run.lcm")
    poses = drive.poses()            # a structured array
    frame = pandas.DataFrame(poses)  # or a pandas table

Needs Debian's python3-numpy.
"""

import numpy as np

import understory
from understory import log


def _named(message_type, prefix=""):
    """The constants of a type by value: their names without the prefix."""
    names = (name for name in vars(message_type) if name.isupper() and name.startswith(prefix))
    return {getattr(message_type, name): name.removeprefix(prefix) for name in names}


STATUS = _named(understory.slam_pose2_t)
HEALTH_STATE = _named(understory.health_t, "STATE_")
KIND = _named(understory.detection_t)

#: Of SLAM_POSE: the others have no pose.
_WITH_POSE = {"FIRST_MAP", "NEW_MAP", "UPDATED", "TRACKED", "COASTING"}
_POSE = [("t_s", float), ("x_m", float), ("y_m", float), ("theta_rad", float)]
_COVARIANCE = [("covariance", float, (3, 3))]


def _compound(first, second):
    """(x, y, theta) of first * second."""
    c, s = np.cos(first.theta), np.sin(first.theta)
    theta = first.theta + second.theta
    return (
        first.x + c * second.x - s * second.y,
        first.y + s * second.x + c * second.y,
        np.arctan2(np.sin(theta), np.cos(theta)),
    )


def _pose(pose):
    return pose.x, pose.y, pose.theta


class Drive:
    """The results in a log, read once. Times are seconds since 1970 of the measurement.

    Raises log.LogError for a file that is no log, ValueError for a damaged message of a used channel.
    """

    _CHANNELS = ["SLAM_POSE", "EKF_POSE", "GROUND_TRUTH", "MAP", "HEALTH"]

    def __init__(self, path):
        self.path = str(path)
        self._messages = {channel: [] for channel in self._CHANNELS}
        for event in log.read(path, self._CHANNELS):
            try:
                message = event.message
            except ValueError as error:
                raise ValueError(f"{self.path}: event {event.number}, {event.channel}: {error}") from error
            if message is None:
                raise ValueError(f"{self.path}: event {event.number}, {event.channel}: no type of understory")
            if event.channel == "MAP":
                self._messages["MAP"] = []  # The last one is the newest.
            self._messages[event.channel].append(message)

    def poses(self):
        """SLAM_POSE: map_T_vehicle with covariance (right perturbation: x, y [m], theta [rad]),
        status (see STATUS) and map_id. Messages without a pose by their status are left out."""
        rows = [
            (m.utime * 1e-6, *_compound(m.map_T_submap, m.submap_T_vehicle), m.covariance, m.status, m.map_id)
            for m in self._messages["SLAM_POSE"]
            if STATUS.get(m.status) in _WITH_POSE
        ]
        return np.array(rows, dtype=[*_POSE, *_COVARIANCE, ("status", int), ("map_id", int)])

    def filter_poses(self):
        """EKF_POSE: ekf_map_T_vehicle with covariance and reset_counter."""
        rows = [
            (m.utime * 1e-6, *_pose(m.ekf_map_T_vehicle), m.covariance, m.reset_counter)
            for m in self._messages["EKF_POSE"]
        ]
        return np.array(rows, dtype=[*_POSE, *_COVARIANCE, ("reset_counter", int)])

    def truth(self):
        """GROUND_TRUTH: world_T_vehicle."""
        rows = [(m.utime * 1e-6, *_pose(m.world_T_vehicle)) for m in self._messages["GROUND_TRUTH"]]
        return np.array(rows, dtype=_POSE)

    def landmarks(self):
        """Landmarks of the last MAP in the log, frame map; kind: see KIND."""
        rows = [
            (one.id, *one.position_m, one.covariance_m2, one.radius_m, one.times_seen, one.kind)
            for message in self._messages["MAP"]
            for one in message.landmarks
        ]
        return np.array(
            rows,
            dtype=[
                ("id", np.int64),
                ("x_m", float),
                ("y_m", float),
                ("covariance_m2", float, (2, 2)),
                ("radius_m", float),
                ("times_seen", int),
                ("kind", int),
            ],
        )

    def keyframes(self):
        """Keyframes of the last MAP in the log: map_T_vehicle with covariance."""
        rows = [
            (one.utime * 1e-6, *_pose(one.map_T_vehicle), one.covariance, one.keyframe_seq)
            for message in self._messages["MAP"]
            for one in message.keyframes
        ]
        return np.array(rows, dtype=[*_POSE, *_COVARIANCE, ("keyframe_seq", int)])

    def health_messages(self):
        """HEALTH messages, unchanged, with all reasons and channels."""
        return list(self._messages["HEALTH"])

    def health(self):
        """HEALTH: process, state (see HEALTH_STATE), the last reason, median and 99th percentile of
        latency [s], resident memory [bytes]. Times are of the sender's clock."""
        rows = [
            (
                m.utime * 1e-6,
                m.process,
                m.state,
                m.last_error_code,
                m.latency_p50_us * 1e-6,
                m.latency_p99_us * 1e-6,
                m.rss_bytes,
            )
            for m in self._messages["HEALTH"]
        ]
        return np.array(
            rows,
            dtype=[
                ("t_s", float),
                ("process", "U40"),
                ("state", int),
                ("last_reason", "U40"),
                ("latency_p50_s", float),
                ("latency_p99_s", float),
                ("rss_bytes", np.int64),
            ],
        )


def _rotation(theta):
    return np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])


def errors_m(poses, truth, hold_first=False):
    """Distance of each pose to the truth at its time [m]; NaN outside the truth's time.

    The frame of the map is aligned with the truth's by the rigid motion that fits all poses best
    (Umeyama 1991 without scale: the ATE is the RMS of the result), or by the first pose alone: the
    stated covariances are relative to it.
    """
    if len(truth) == 0:
        return np.full(len(poses), np.nan)
    inside = (poses["t_s"] >= truth["t_s"][0]) & (poses["t_s"] <= truth["t_s"][-1])
    result = np.full(len(poses), np.nan)
    if np.count_nonzero(inside) < 2:
        return result
    t_s = poses["t_s"][inside]
    there = np.column_stack([np.interp(t_s, truth["t_s"], truth[axis]) for axis in ("x_m", "y_m")])
    here = np.column_stack([poses["x_m"][inside], poses["y_m"][inside]])
    if hold_first:
        first_theta = np.interp(t_s[0], truth["t_s"], np.unwrap(truth["theta_rad"]))
        there_R_here = _rotation(first_theta - poses["theta_rad"][inside][0])
        from_here, from_there = here - here[0], there - there[0]
    else:
        from_here, from_there = here - here.mean(axis=0), there - there.mean(axis=0)
        u, _, vt = np.linalg.svd(from_there.T @ from_here)
        there_R_here = u @ np.diag([1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    result[inside] = np.linalg.norm(from_there - from_here @ there_R_here.T, axis=1)
    return result
