// A levelled sample of a sweep's points, for fitting the ground.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/landmark_extractor/points/point_blocks.hpp"

namespace understory::landmark_extractor::ground {

/// Every n-th column of a sweep with many points. Reuses memory between sweeps, but has no state.
class GroundSample {
 public:
  /// Takes about 20000 points. The grid covers levelling.max_range_m around the sensor.
  void take(const model::PointSweep& sweep, const points::Levelling& levelling);

  /// The grid of the cells below.
  const points::GroundGrid& grid() const { return grid_; }
  /// Coordinates in frame `vehicle_level` [m]; padded to a whole number of registers. Points in the
  /// cell nowhere() are not used.
  std::span<const float> x() const { return {x_.data(), size_}; }
  /// See x().
  std::span<const float> y() const { return {y_.data(), size_}; }
  /// See x().
  std::span<const float> z() const { return {z_.data(), size_}; }
  /// Index of each point's cell in the grid.
  std::span<const std::int32_t> cell() const { return {cell_.data(), size_}; }

 private:
  void reserve(std::size_t size);
  void pad(std::size_t size);

  points::GroundGrid grid_;
  points::PointBlock block_;
  std::size_t size_ = 0;
  std::vector<float> x_;
  std::vector<float> y_;
  std::vector<float> z_;
  std::vector<std::int32_t> cell_;
};

}  // namespace understory::landmark_extractor::ground
