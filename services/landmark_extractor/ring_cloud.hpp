// The points of one turn, levelled and put in order: ring by ring, each in order of azimuth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "services/landmark_extractor/spin_fit.hpp"

namespace understory {

/// A return in `vehicle_level`, with the beam that brought it.
struct RingPoint {
  float x_m = 0.0F;
  float y_m = 0.0F;
  float z_m = 0.0F;
  float azimuth_rad = 0.0F;  ///< Of the beam, left positive; goes on beyond pi within a ring.
  float range_m = 0.0F;      ///< Horizontal distance from where the sensor was at that time.
  float height_m = 0.0F;     ///< Above ground.
  float time_s = 0.0F;       ///< From the sweep's utime.

  Eigen::Vector2d position() const { return {x_m, y_m}; }
};

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

/// Keeps its memory from sweep to sweep.
class RingCloud {
 public:
  /// Takes the points whose horizontal distance to the sensor is within the limits.
  /// Precondition: 1 <= sweep.rings, attitude finite.
  void fill(const PointSweep& sweep, double min_range_m, double max_range_m,
            PointCounters& counters);

  std::size_t rings() const { return steps_.size(); }
  std::size_t size() const { return points_.size(); }
  std::span<RingPoint> points() { return points_; }
  std::span<const RingPoint> points() const { return points_; }
  std::size_t ring_begin(std::size_t ring) const { return begins_[ring]; }
  std::size_t ring_end(std::size_t ring) const { return begins_[ring + 1]; }
  /// Points of one ring; azimuth grows.
  std::span<const RingPoint> ring(std::size_t ring) const {
    return std::span(points_).subspan(begins_[ring], begins_[ring + 1] - begins_[ring]);
  }
  /// Azimuth from beam to beam [rad]; 0 for a ring with too few points to tell.
  float step_rad(std::size_t ring) const { return steps_[ring]; }
  /// Of the sensor at utime, frame `vehicle_level`.
  const Eigen::Vector3f& sensor_m() const { return sensor_; }
  /// Of the sensor during the turn, as its points tell; frame `vehicle`, in the plan.
  const Eigen::Vector2f& velocity_mps() const { return spin_.velocity_mps; }
  /// Where the sensor was when it measured the point, and whereto it looked.
  Sight sight(const RingPoint& point) const {
    const Eigen::Vector2d origin =
        (sensor_.head<2>() + point.time_s * level_velocity_.head<2>()).cast<double>();
    return {origin, (point.position() - origin) / static_cast<double>(point.range_m)};
  }
  /// The same as slope() without a look at the points: good to a few centimetres in height.
  float rough_slope(std::size_t ring, float azimuth_rad) const;
  /// Rise of a ring's beams per metre of range where they look into the direction. Precondition:
  /// the ring has points.
  float slope(std::size_t ring, float azimuth_rad) const;
  /// The first point of the ring at or beyond the azimuth (any turn), as an index into points();
  /// ring_end(ring) where there is none.
  std::size_t first_at(std::size_t ring, float azimuth_rad) const;

 private:
  void reserve_rings(const PointSweep& sweep, PointCounters& counters);
  void scatter(const PointSweep& sweep, double min_range_m, double max_range_m,
               PointCounters& counters);
  void order_ring(std::size_t ring);
  void measure_step(std::size_t ring);

  std::vector<RingPoint> scattered_;  ///< Ring by ring as they came, with gaps between rings.
  std::vector<std::size_t> slots_;    ///< Where each ring begins there.
  std::vector<std::size_t> next_;     ///< Where each ring ends there.
  std::vector<RingPoint> points_;
  std::vector<std::size_t> begins_;
  std::vector<float> steps_;
  std::vector<float> differences_;
  std::vector<std::size_t> counts_;
  Spin spin_;
  Eigen::Matrix3f level_R_vehicle_ = Eigen::Matrix3f::Identity();
  Eigen::Vector3f sensor_ = Eigen::Vector3f::Zero();
  Eigen::Vector3f level_velocity_ = Eigen::Vector3f::Zero();
};

}  // namespace understory
