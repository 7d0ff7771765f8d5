// A revolution of the laser as if it had been measured in one instant.
#pragma once

#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "services/lidar_imu_input/motion_history.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// When the last point of the sweep was measured.
model::Utime end_of_revolution(const model::PointSweep& sweep);

/// Takes out points that are not finite, have a time that no revolution has (outside 0 to 1 s), or
/// are nearer than `min_range_m`; returns how many were of the first two kinds.
std::size_t remove_bad_points(model::PointSweep& sweep, double min_range_m);

/// Times of a sweep that has none, from the azimuth of each point: the laser turns evenly, from the
/// azimuth of the first point on, once in `revolution_s`. Points are then in order of time.
void times_from_azimuth(model::PointSweep& sweep, double revolution_s, bool clockwise);

/// Whether the beams come one after another, over a time that a revolution can have.
bool has_beam_times(const model::PlanarScan& scan);
/// The returns of a scan in one plane, each with its time, as a sweep of one ring; frame sensor.
model::PointSweep sweep_of(const model::PlanarScan& scan);

/// A sweep in frame vehicle.
struct DeskewedSweep {
  model::PointSweep sweep;  ///< Point times count back from its stamp: none is positive.
  bool had_motion = false;  ///< False: points were moved to frame vehicle as they are.
};

/// The sweep (frame sensor) in frame vehicle at `utime` (not before its last point), attitude
/// attached. Motion from `history`, exact every millisecond and linear in between. `mount`: of the
/// laser. Cost: two 3 x 4 products per point; the points are moved in place.
DeskewedSweep deskew(model::PointSweep raw, model::Utime utime, const MotionHistory& history,
                     const SensorMount& mount);

}  // namespace understory::lidar_imu_input
