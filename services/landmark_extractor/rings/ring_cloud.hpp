// The points of one revolution, levelled and sorted: ring by ring, each in order of azimuth.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/points/point_blocks.hpp"
#include "services/landmark_extractor/points/spin_fit.hpp"
#include "services/landmark_extractor/rings/ring_slots.hpp"

namespace understory::landmark_extractor::rings {

/// A line of sight, seen from above, frame `vehicle_level`.
struct Sight {
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< Unit.
};

/// Rise of every ring's beams per metre of range in one direction.
class RoughSlopes {
 public:
  /// `slopes`: of the rings, frame `vehicle`; `towards`: unit, frame `vehicle_level`.
  RoughSlopes(const Eigen::Matrix3f& level_R_vehicle, const std::vector<float>& slopes,
              const Eigen::Vector2f& towards)
      : slopes_(slopes) {
    const Eigen::Vector3f beam = level_R_vehicle.transpose().leftCols<2>() * towards;
    ahead_ = level_R_vehicle.leftCols<2>() * beam.head<2>();
    up_ = level_R_vehicle.col(2) * beam.head<2>().norm();
  }
  /// Of one ring, frame `vehicle_level`; NaN for a ring without points.
  float operator()(std::size_t ring) const {
    const Eigen::Vector3f beam = ahead_ + slopes_[ring] * up_;
    return beam.z() / beam.head<2>().norm();
  }

 private:
  std::span<const float> slopes_;
  Eigen::Vector3f ahead_;
  Eigen::Vector3f up_;
};

/// The levelled, sorted points of one sweep and the sensor's position at each of them. Reuses
/// memory between sweeps; no data of one sweep enter the next. Call look_at(), fill(), then order()
/// once for each ring.
class RingCloud {
 public:
  /// Sets the sensor's attitude and estimates its motion. Precondition: 1 <= sweep.rings, attitude
  /// finite.
  const points::Levelling& look_at(const model::PointSweep& sweep, double min_range_m,
                                   double max_range_m);
  /// Adds the points whose horizontal distance to the sensor is within the limits. Adds to
  /// `counters`. Precondition: look_at() with the same sweep.
  void fill(const model::PointSweep& sweep, const ground::GroundSurface& ground,
            PointCounters& counters);

  /// Sorts one ring: once for each ring after fill(), before its points are used. A separate call,
  /// so that the next steps find the ring in the cache. Points lower than `lowest_m` above ground
  /// belong to no object.
  void order(std::size_t ring, float lowest_m);

  std::size_t rings() const { return rings_.size(); }  ///< Number of the sensor's rings.
  /// Of all rings, by index; the gaps between the rings are undefined.
  std::span<const points::RingPoint> points() const { return slots_.points(); }
  /// Returns beyond the range, of all rings, levelled; they have no height above ground.
  std::span<const points::RingPoint> far_points() const { return slots_.far_points(); }
  std::size_t ring_begin(std::size_t ring) const { return rings_[ring].begin; }  ///< Into points().
  std::size_t ring_end(std::size_t ring) const {
    return rings_[ring].end;
  }  ///< One beyond its last point.
  /// Azimuth from beam to beam [rad]; 0 for a ring with too few points.
  float step_rad(std::size_t ring) const { return rings_[ring].step_rad; }
  /// Of the sensor at utime, frame `vehicle_level`.
  const Eigen::Vector3f& sensor_m() const { return levelling_.sensor_m; }
  /// Rate of the sensor's rotation, left positive; 0 = unknown.
  float spin_radps() const { return spin_.rate_radps; }
  /// Of the sensor during the revolution, frame `vehicle_level`.
  const Eigen::Vector3f& level_velocity_mps() const { return levelling_.velocity_mps; }
  /// The same in frame `vehicle`, in the plan.
  const Eigen::Vector2f& velocity_mps() const { return spin_.velocity_mps; }

  /// The sensor's position at the time of the point, and the direction of the beam.
  Sight sight(const points::RingPoint& point) const {
    const Eigen::Vector2d origin =
        (sensor_m().head<2>() + point.time_s * levelling_.velocity_mps.head<2>()).cast<double>();
    return {origin, (point.position() - origin) / static_cast<double>(point.range_m)};
  }
  /// The sensor's position at the time of a beam direction, from a measured point near that
  /// direction: the sensor rotates at a constant rate.
  Eigen::Vector2d origin_towards(float azimuth_rad, const points::RingPoint& point) const {
    float time = point.time_s;
    if (spin_.rate_radps != 0.0F) {
      time += points::wrap_angle_f(azimuth_rad - point.azimuth_rad) / spin_.rate_radps;
    }
    return (sensor_m().head<2>() + time * levelling_.velocity_mps.head<2>()).cast<double>();
  }
  /// slope() of all rings without reading the points: accurate to a few centimetres in height.
  RoughSlopes rough_slopes(const Eigen::Vector2f& towards) const {
    return {levelling_.level_R_vehicle, slopes_, towards};
  }
  /// Rise of a ring's beams per metre of range in a direction. Precondition: the ring has points.
  float slope(std::size_t ring, float azimuth_rad) const {
    const std::size_t at = std::min(first_at(ring, azimuth_rad), ring_end(ring) - 1);
    return slope(ring, points()[at], azimuth_rad);
  }
  /// Likewise, given a point of the ring near that direction.
  float slope(std::size_t ring, const points::RingPoint& near, float azimuth_rad) const;
  /// The first point of the ring at or beyond the azimuth (any turn), as an index into points();
  /// ring_end(ring) if there is none. Cost: logarithmic, mostly a few steps.
  std::size_t first_at(std::size_t ring, float azimuth_rad) const;

 private:
  /// One ring after order().
  struct Ring {
    std::size_t begin = 0;
    std::size_t end = 0;
    float step_rad = 0.0F;
  };

  void measure_step(Ring& ring);
  void measure_slope(std::size_t ring);

  points::SpinFitter spin_fitter_;
  points::Spin spin_;
  points::Levelling levelling_;
  RingSlots slots_;
  std::vector<Ring> rings_;
  std::vector<float> slopes_;  ///< Rise per metre of range, frame `vehicle`; NaN = no points.
  std::vector<float> differences_;
};

}  // namespace understory::landmark_extractor::rings
