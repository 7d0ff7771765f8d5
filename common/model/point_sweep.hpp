// One revolution of a laser that scans in space.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::model {

/// One return of a beam.
struct SweepPoint {
  float x_m = 0.0F;
  float y_m = 0.0F;
  float z_m = 0.0F;
  /// Time of measurement relative to the sweep's utime; negative = before it.
  float time_s = 0.0F;
  std::uint16_t ring = 0;      ///< Beam that measured it, 0 = lowest elevation.
  std::uint8_t intensity = 0;  ///< Raw value of the sensor.

  /// Position [m], in the frame of the sweep.
  Eigen::Vector3f position() const { return {x_m, y_m, z_m}; }
};

/// Roll and pitch of the vehicle relative to gravity.
struct Attitude {
  /// Transforms coordinates of `vehicle` to `vehicle_level`; no rotation about the vertical.
  Eigen::Quaterniond level_Q_vehicle = Eigen::Quaterniond::Identity();
  /// Covariance of (roll, pitch) [rad^2].
  Eigen::Matrix2d covariance_rad2 = Eigen::Matrix2d::Zero();
};

/// Channel RAW_SWEEP: frame `sensor` at the time of each point, not de-skewed; utime is that of the
/// first point (times >= 0). Channel LIDAR_SWEEP: frame `vehicle` at utime, the end of the
/// revolution, de-skewed: all points relative to the vehicle's pose at utime (times <= 0).
///
/// Beams without a return have no point. Points are in order of time, within one firing in order of
/// ring. A sweep is large: the bus transports it in ordered parts, `part` of `parts`, each with the
/// header.
struct PointSweep {
  Utime utime = 0;
  std::uint64_t sequence = 0;    ///< Counts messages (parts) of the channel.
  std::uint64_t revolution = 0;  ///< Counts revolutions; the same for all parts of one.
  std::uint16_t part = 0;        ///< Number of this part, from 0.
  std::uint16_t parts = 1;       ///< Parts of the revolution.
  bool has_times = true;         ///< False: the points' times are not known (all 0).
  bool is_deskewed = false;      ///< Frame `vehicle` at utime; else frame `sensor`.
  std::uint16_t rings = 0;       ///< Number of beams.
  double max_range_m = 0.0;      ///< Range of the sensor.
  /// Position of the sensor in the frame of the points.
  Eigen::Vector3d sensor_position_m = Eigen::Vector3d::Zero();
  std::optional<Attitude>
      attitude;  ///< Attitude at utime; none = unknown (raw sweep, or before it settled).
  std::vector<SweepPoint> points;
};

/// The sweep in parts of at most `max_points` points, each with the header. Throws
/// std::invalid_argument where `max_points` is 0 or more than 65,535 parts are needed.
std::vector<PointSweep> split_sweep(const PointSweep& sweep, std::size_t max_points);

/// Joins the parts of a revolution, in any order; parts of two revolutions may be mixed. An
/// incomplete revolution is dropped and counted when a later one is complete, or when the second
/// one after it begins.
class SweepAssembler {
 public:
  /// Adds a part; returns the revolution if it is complete, else none.
  std::optional<PointSweep> add(PointSweep part);
  /// Revolutions that were dropped.
  std::uint64_t incomplete_revolutions() const { return incomplete_; }

 private:
  /// The received parts of one revolution.
  struct Pending {
    std::vector<PointSweep> parts;

    bool takes(const PointSweep& part) const;
    PointSweep join() &&;
  };
  static constexpr std::size_t kMostPending = 2;
  void drop_oldest();

  std::deque<Pending> pending_;  ///< Ordered by begin.
  std::optional<Utime>
      latest_;  ///< Latest complete or dropped revolution: its late parts are ignored.
  std::uint64_t incomplete_ = 0;
};

}  // namespace understory::model
