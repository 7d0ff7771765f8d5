// Levelling and heights of all points of a sweep, several points at once.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/points/ground_grid.hpp"

namespace understory::landmark_extractor::points {

/// A return in `vehicle_level`, with its beam. As long as one vector register, and without initial
/// values, so that allocating memory for many costs nothing.
struct alignas(32) RingPoint {
  float x_m;
  float y_m;
  float z_m;
  float azimuth_rad;  ///< Of the beam, left positive; continuous beyond pi within a ring.
  float range_m;      ///< Horizontal distance from the sensor's position at that time.
  float height_m;     ///< Above ground.
  float time_s;       ///< From the sweep's utime.
  float is_in_range;  ///< 1, or 0 if a coordinate is too near, too far or NaN.

  /// In the plan.
  Eigen::Vector2d position() const { return {x_m, y_m}; }
};

/// Some points, coordinate by coordinate.
struct PointBlock {
  static constexpr std::size_t kSize = 128;  ///< Most points.
  /// One value per point.
  template <class Value>
  using Array = std::array<Value, kSize>;

  alignas(32) Array<float> x{};  ///< Frame `vehicle_level`.
  Array<float> y{};
  Array<float> z{};
  Array<float> time{};
  Array<float> range{};
  Array<float> azimuth{};
  Array<float> height{};  ///< Above ground.
  Array<float> in_range{};
  Array<std::int32_t> cell{};
  Array<RingPoint> points{};
};

/// Conversion of a sweep's points to levelled points around the sensor.
struct Levelling {
  Eigen::Matrix3f level_R_vehicle = Eigen::Matrix3f::Identity();
  Eigen::Vector3f sensor_m = Eigen::Vector3f::Zero();      ///< Frame `vehicle_level`, at utime.
  Eigen::Vector3f velocity_mps = Eigen::Vector3f::Zero();  ///< Same frame.
  float min_range_m = 0.0F;                                ///< Horizontal distance to the sensor.
  float max_range_m = 0.0F;                                ///< Likewise.
};

/// Above or below the vehicle: points on the ground are within this [m].
inline constexpr float kHighest_m = 1000.0F;

/// Fills x, y, z and cell, which is nowhere() for points that are not used: out of range from the
/// sensor's position at utime, or NaN. Precondition: at most PointBlock::kSize points.
void locate_block(std::span<const model::SweepPoint> points, const Levelling& by,
                  const GroundGrid& grid, PointBlock& block);
/// Fills `points`, levelled and with heights above ground. `patches`: one per node of the grid.
/// Precondition: at most PointBlock::kSize points.
void place_block(std::span<const model::SweepPoint> points, const Levelling& by,
                 const GroundGrid& grid, const GroundPatch* patches, PointBlock& block);
/// Sets height = z - the surface at (x, y), for `count` places: a whole number of registers of 8.
void heights_above(const float* x, const float* y, const float* z, std::size_t count,
                   const GroundGrid& grid, const GroundPatch* patches, float* height);

}  // namespace understory::landmark_extractor::points
