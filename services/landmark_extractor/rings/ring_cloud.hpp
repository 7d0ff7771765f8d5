// The points of one turn, levelled and put in order: ring by ring, each in order of azimuth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/ground/ground_surface.hpp"
#include "services/landmark_extractor/points/point_blocks.hpp"
#include "services/landmark_extractor/points/spin_fit.hpp"

namespace understory::landmark_extractor::rings {

/// A line of sight, seen from above.
struct Sight {
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< Unit.
};

/// What was wrong with the points of a sweep.
struct PointCounters {
  std::uint64_t not_finite = 0;
  std::uint64_t bad_ring = 0;  ///< A ring that the sensor does not have.
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
  float operator()(std::size_t ring) const {
    const Eigen::Vector3f beam = ahead_ + slopes_[ring] * up_;
    return beam.z() / beam.head<2>().norm();
  }

 private:
  std::span<const float> slopes_;
  Eigen::Vector3f ahead_;
  Eigen::Vector3f up_;
};

/// Keeps its memory from sweep to sweep.
class RingCloud {
 public:
  /// Learns the sensor's attitude and motion. Precondition: 1 <= sweep.rings, attitude finite.
  const points::Levelling& look_at(const model::PointSweep& sweep, double min_range_m,
                                   double max_range_m);
  /// Takes the points whose horizontal distance to the sensor is within the limits.
  /// Precondition: look_at() the same sweep.
  void fill(const model::PointSweep& sweep, const ground::GroundSurface& ground,
            PointCounters& counters);

  /// Puts one ring in order: once for each ring after fill(), before its points are asked for. On
  /// its own so that what follows finds the ring still at hand. What is lower than `lowest_m`
  /// above ground is no object.
  void order(std::size_t ring, float lowest_m);

  std::size_t rings() const { return steps_.size(); }
  /// Of all rings, by index; between the rings are gaps, which mean nothing.
  std::span<const points::RingPoint> points() const { return {points_.get(), capacity_}; }
  std::size_t ring_begin(std::size_t ring) const { return begins_[ring]; }
  std::size_t ring_end(std::size_t ring) const { return ends_[ring]; }
  /// Azimuth from beam to beam [rad]; 0 for a ring with too few points to tell.
  float step_rad(std::size_t ring) const { return steps_[ring]; }
  /// Of the sensor at utime, frame `vehicle_level`.
  const Eigen::Vector3f& sensor_m() const { return levelling_.sensor_m; }
  /// Of the sensor during the turn, frame `vehicle_level`.
  const Eigen::Vector3f& level_velocity_mps() const { return levelling_.velocity_mps; }
  /// Of the sensor during the turn, as its points tell; frame `vehicle`, in the plan.
  const Eigen::Vector2f& velocity_mps() const { return spin_.velocity_mps; }
  /// Where the sensor was when it measured the point, and whereto it looked.
  Sight sight(const points::RingPoint& point) const {
    const Eigen::Vector2d origin =
        (sensor_m().head<2>() + point.time_s * levelling_.velocity_mps.head<2>()).cast<double>();
    return {origin, (point.position() - origin) / static_cast<double>(point.range_m)};
  }
  /// Where the sensor was when it looked into the direction, as a point tells that it measured in
  /// about that turn: the sensor turns evenly.
  Eigen::Vector2d origin_towards(float azimuth_rad, const points::RingPoint& point) const {
    float time = point.time_s;
    if (spin_.rate_radps != 0.0F) {
      time += points::wrap_angle_f(azimuth_rad - point.azimuth_rad) / spin_.rate_radps;
    }
    return (sensor_m().head<2>() + time * levelling_.velocity_mps.head<2>()).cast<double>();
  }
  /// What slope() is without a look at the points: good to a few centimetres in height.
  RoughSlopes rough_slopes(const Eigen::Vector2f& towards) const {
    return {levelling_.level_R_vehicle, slopes_, towards};
  }
  /// Rise of a ring's beams per metre of range where they look into the direction. Precondition:
  /// the ring has points.
  float slope(std::size_t ring, float azimuth_rad) const {
    return slope(ring, points_[std::min(first_at(ring, azimuth_rad), ends_[ring] - 1)],
                 azimuth_rad);
  }
  /// The same where a point of the ring in that direction is known.
  float slope(std::size_t ring, const points::RingPoint& near, float azimuth_rad) const;
  /// The first point of the ring at or beyond the azimuth (any turn), as an index into points();
  /// ring_end(ring) where there is none.
  std::size_t first_at(std::size_t ring, float azimuth_rad) const;

 private:
  /// One ring while its points come in.
  struct Filling {
    points::RingPoint* next = nullptr;  ///< Where the next point goes.
    points::RingPoint* full = nullptr;  ///< Where there is no more place.
    float azimuth_rad = 0.0F;           ///< Of the last point; NaN = none yet.
    float turned_rad = 0.0F;            ///< Whole turns since the ring's first point.
  };

  void reserve_slots(std::size_t rings, std::size_t points_per_ring);
  /// False when a ring has more points than its slot takes.
  bool scatter(const model::PointSweep& sweep, const ground::GroundSurface& ground,
               PointCounters& counters);
  void cut_ring(std::size_t ring, float lowest_m);
  void measure_step(std::size_t ring);
  void measure_slope(std::size_t ring);

  points::SpinFitter spin_fitter_;
  points::Levelling levelling_;
  points::PointBlock block_;
  std::unique_ptr<points::RingPoint[]> points_;  ///< A slot per ring, twice as long as it at least.
  std::size_t capacity_ = 0;
  std::size_t slot_ = 0;  ///< Points from slot to slot.
  std::vector<Filling> filling_;
  std::vector<std::size_t> begins_;
  std::vector<std::size_t> ends_;
  std::vector<float> steps_;
  std::vector<float> slopes_;  ///< Rise per metre of range, frame `vehicle`; NaN = no points.
  std::vector<float> differences_;
  points::Spin spin_;
};

}  // namespace understory::landmark_extractor::rings
