"""Stored maps (GeoPackage files of `understory map` and of a drive) as numpy arrays.

    stems = maps.landmarks("forest.gpkg", map_id=1)

Needs Debian's python3-numpy. The file is opened read-only and is never changed.
"""

import sqlite3
import struct
from contextlib import closing
from urllib.parse import quote

import numpy as np

# GeoPackage binary header with an empty envelope, then a little-endian WKB point (OGC 12-128, 2.1.3).
_POINT = struct.Struct("<2sBBiBIdd")


class MapError(ValueError):
    """A map file that cannot be read; the text has the file's name."""


def _rows(path, query, values=()):
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path))}?mode=ro", uri=True)) as file:
            return file.execute(query, values).fetchall()
    except sqlite3.Error as error:
        raise MapError(f"{path}: {error}") from error


def _point(path, blob):
    if len(blob) != _POINT.size or blob[:2] != b"GP":
        raise MapError(f"{path}: a geometry that is no point")
    return _POINT.unpack(blob)[-2:]


def map_ids(path):
    """Numbers of the maps in the file, in order."""
    return [row[0] for row in _rows(path, "SELECT map_id FROM understory_maps ORDER BY map_id")]


def landmarks(path, map_id=None):
    """Landmarks of one map, or of all: position in the frame of the file [m], covariance [m^2],
    diameter [m] (NaN: unknown), kind, times_seen, existence (probability; NaN: unknown). The file
    has landmarks of submaps already converted to this frame."""
    where = "" if map_id is None else " WHERE map_id = ?"
    rows = _rows(
        path,
        "SELECT landmark_id, map_id, geom, covariance_xx_m2, covariance_xy_m2, covariance_yy_m2, diameter_m, kind,"
        f" times_seen, existence FROM landmarks{where} ORDER BY landmark_id",
        () if map_id is None else (map_id,),
    )
    nan = float("nan")
    filled = []
    for one, of_map, geometry, xx, xy, yy, diameter_m, kind, times_seen, existence in rows:
        covariance = [[nan, nan], [nan, nan]] if xx is None else [[xx, xy], [xy, yy]]
        place = _point(path, geometry)
        diameter_m = nan if diameter_m is None else diameter_m
        existence = nan if existence is None else existence
        filled.append((one, of_map, *place, covariance, diameter_m, kind, times_seen, existence))
    return np.array(
        filled,
        dtype=[
            ("id", np.int64),
            ("map_id", int),
            ("x_m", float),
            ("y_m", float),
            ("covariance_m2", float, (2, 2)),
            ("diameter_m", float),
            ("kind", "U8"),
            ("times_seen", int),
            ("existence", float),
        ],
    )


def trajectory(path, map_id=None):
    """Keyframes of one map, or of all: time [s since 1970], position [m], heading [rad]."""
    where = "" if map_id is None else " WHERE map_id = ?"
    rows = _rows(
        path,
        f"SELECT map_id, sequence, utime, geom, heading_rad FROM trajectory{where} ORDER BY map_id, sequence",
        () if map_id is None else (map_id,),
    )
    filled = [(of, number, utime * 1e-6, *_point(path, at), heading) for of, number, utime, at, heading in rows]
    return np.array(
        filled,
        dtype=[
            ("map_id", int),
            ("keyframe_seq", int),
            ("t_s", float),
            ("x_m", float),
            ("y_m", float),
            ("theta_rad", float),
        ],
    )
