// De-skewing: transforms a revolution of the laser to one instant.
#pragma once

#include "common/model/planar_scan.hpp"
#include "common/model/point_sweep.hpp"
#include "services/lidar_imu_input/motion_history.hpp"
#include "services/lidar_imu_input/parameters.hpp"

namespace understory::lidar_imu_input {

/// Time of the sweep's last point.
model::Utime end_of_revolution(const model::PointSweep& sweep);

/// Removes points that are not finite, have an impossible time (outside 0 to 1 s), or are nearer
/// than `min_range_m`; returns the number of the first two kinds.
std::size_t remove_bad_points(model::PointSweep& sweep, double min_range_m);

/// Computes the times of a sweep without times from the azimuth of each point: the laser turns at a
/// constant rate, from the azimuth of the first point, once in `revolution_s`. Points are then in
/// order of time.
void times_from_azimuth(model::PointSweep& sweep, double revolution_s, bool clockwise);

/// Whether the beams have different times, within the duration of a revolution.
bool has_beam_times(const model::PlanarScan& scan);
/// The returns of a scan in one plane, each with its time, as a sweep of one ring; frame sensor.
model::PointSweep sweep_of(const model::PlanarScan& scan);

/// A sweep in frame vehicle.
struct DeskewedSweep {
  model::PointSweep sweep;  ///< Point times count back from its stamp: none is positive.
  bool had_motion = false;  ///< False: points were transformed to frame vehicle without motion.
};

/// The sweep (frame sensor) in frame vehicle at `utime` (not before its last point), with the
/// attitude. Motion from `history`, exact every millisecond and linear in between. `mount`: of the
/// laser. Cost: two 3 x 4 products per point; the points are moved in place.
DeskewedSweep deskew(model::PointSweep raw, model::Utime utime, const MotionHistory& history,
                     const SensorMount& mount);

}  // namespace understory::lidar_imu_input
