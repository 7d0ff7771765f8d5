// A sweep that grows point by point.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/point_sweep.hpp"

namespace understory::packets {

/// Collects points with absolute times and returns them as a sweep with the utime of the earliest.
class SweepBuilder {
 public:
  /// `rings`, `max_range_m`: those of the sensor.
  SweepBuilder(std::uint16_t rings, double max_range_m)
      : rings_(rings), max_range_m_(max_range_m) {}

  /// Adds a point in frame `sensor`, measured at `time_ns` [ns since 1970]. Skips it if the sweep
  /// has kMostPoints, for a sensor that never ends its sweeps.
  void add(const Eigen::Vector3f& position_m, std::int64_t time_ns, std::uint16_t ring,
           std::uint8_t intensity);
  /// The sweep, in order of time and of ring; none without points. Then the next sweep begins.
  std::optional<model::PointSweep> take();
  /// Drops the points.
  void clear();

  static constexpr std::size_t kMostPoints = 2'000'000;  ///< Largest number of points of a sweep.
  std::size_t size() const { return points_.size(); }    ///< Points so far.

 private:
  std::uint16_t rings_;
  double max_range_m_;
  std::vector<model::SweepPoint> points_;
  std::vector<std::int64_t> times_ns_;
  std::uint64_t revolutions_ = 0;
};

}  // namespace understory::packets
