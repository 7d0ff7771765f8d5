// One turn of a laser that scans in space.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::model {

struct SweepPoint {
  float x_m = 0.0F;
  float y_m = 0.0F;
  float z_m = 0.0F;
  float time_s = 0.0F;     ///< Of the measurement, from the sweep's utime; negative = before it.
  std::uint16_t ring = 0;  ///< Beam that measured it, 0 = lowest elevation.
  std::uint8_t intensity = 0;

  Eigen::Vector3f position() const { return {x_m, y_m, z_m}; }
};

/// Roll and pitch of the vehicle against gravity.
struct Attitude {
  /// Takes coordinates of `vehicle` to `vehicle_level`; no rotation about the vertical.
  Eigen::Quaterniond level_Q_vehicle = Eigen::Quaterniond::Identity();
  /// Covariance of (roll, pitch) [rad^2].
  Eigen::Matrix2d covariance_rad2 = Eigen::Matrix2d::Zero();
};

/// Channel RAW_SWEEP: frame `sensor`, each point where the sensor saw it at the time of its own, as
/// the sensor gives it; utime is that of the first point (times >= 0).
/// Channel LIDAR_SWEEP: frame `vehicle` at utime, de-skewed (all points as seen from the pose that
/// the vehicle has at utime, the end of the turn; times <= 0).
///
/// Beams without a return have no point. Points are in order of time; of one firing, in order of
/// ring. Large: on the bus it travels in parts, in order; `part` of `parts`, each with the header
/// repeated.
struct PointSweep {
  Utime utime = 0;
  std::uint64_t sequence = 0;  ///< Counts messages (parts) of the channel.
  std::uint64_t turn = 0;      ///< Counts turns of the sensor; the same for all parts of one.
  std::uint16_t part = 0;
  std::uint16_t parts = 1;
  bool has_times = true;     ///< False: the points' times are not known (all 0).
  bool is_deskewed = false;  ///< Frame `vehicle` at utime; else frame `sensor`.
  std::uint16_t rings = 0;   ///< Number of beams.
  double max_range_m = 0.0;
  Eigen::Vector3d sensor_position_m = Eigen::Vector3d::Zero();  ///< In the frame of the points.
  std::optional<Attitude> attitude;  ///< At utime; none = not known (raw, or before it settled).
  std::vector<SweepPoint> points;
};

/// The sweep in parts of at most `max_points` points, which share the header.
std::vector<PointSweep> split_sweep(const PointSweep& sweep, std::size_t max_points);

/// Puts parts together again. A turn of which a part is missing is dropped and counted.
class SweepAssembler {
 public:
  /// The whole turn when its last part comes in, else none. Parts must come in order.
  std::optional<PointSweep> add(PointSweep part);
  std::uint64_t incomplete_revolutions() const { return incomplete_; }

 private:
  void count_incomplete(std::uint64_t turn);

  std::optional<PointSweep> pending_;
  std::optional<std::uint64_t> lost_revolution_;  ///< Counted already.
  std::uint16_t next_part_ = 0;
  std::uint64_t incomplete_ = 0;
};

}  // namespace understory::model
