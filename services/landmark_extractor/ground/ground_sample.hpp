// Returns that tell where the ground is: enough of a turn's points, levelled.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/landmark_extractor/points/point_blocks.hpp"

namespace understory::landmark_extractor::ground {

/// Every so manieth column of a turn that has many. Keeps its memory from sweep to sweep.
class GroundSample {
 public:
  /// The grid covers levelling.max_range_m around the sensor.
  void take(const model::PointSweep& sweep, const points::Levelling& levelling);

  const points::GroundGrid& grid() const { return grid_; }
  /// Frame `vehicle_level`; their number is a whole number of registers. Those in the cell
  /// nowhere() do not count.
  std::span<const float> x() const { return {x_.data(), size_}; }
  std::span<const float> y() const { return {y_.data(), size_}; }
  std::span<const float> z() const { return {z_.data(), size_}; }
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
