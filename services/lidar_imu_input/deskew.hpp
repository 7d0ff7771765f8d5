// A turn of the laser as if it had been measured in one instant.
#pragma once

#include "common/model/point_sweep.hpp"
#include "services/lidar_imu_input/motion_history.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// When the last point of the sweep was measured.
model::Utime end_of_revolution(const model::PointSweep& sweep);

/// Takes out points that are not finite, have a time that no turn has, or are nearer than
/// `min_range_m`; returns how many were of the first two kinds.
std::size_t remove_bad_points(model::PointSweep& sweep, double min_range_m);

/// Times of a sweep that has none, from the azimuth of each point: the laser turns evenly, from the
/// azimuth of the first point on. Points are then in order of time.
void times_from_azimuth(model::PointSweep& sweep, double revolution_s, bool clockwise);

/// The sweep in frame vehicle at `utime` (not before its last point), attitude attached. Motion
/// from `history`; where that has none, points are moved to frame vehicle as they are.
struct DeskewedSweep {
  model::PointSweep sweep;
  bool had_motion = false;
};
DeskewedSweep deskew(model::PointSweep raw, model::Utime utime, const MotionHistory& history,
                     const SensorMount& mount);

}  // namespace understory::lidar_imu_input
