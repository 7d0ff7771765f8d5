// Scale of measured distances relative to odometry's scale.
#pragma once

#include <optional>
#include <span>
#include <utility>

#include "common/geometry/se2.hpp"
#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Position of the vehicle at a time, from landmarks alone.
struct LocatedKeyframe {
  model::Utime utime = 0;
  geometry::SE2 map_T_vehicle;
  double variance_m2 = 0.0;  ///< Per axis.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.map_T_vehicle, s.variance_m2);
  }
};

/// Distances from a laser or a detector may all be wrong by the same ratio: a trunk is seen from
/// its front, a clock is off by some ppm. Landmarks cannot show it, since the whole map scales with
/// it. Odometry can, if its own scale is known better: the ratio of the two is estimated by linear
/// regression of motions, with priors for both scales.
///
/// The map is kept in the units of the landmarks, which are hundreds of times more precise than
/// odometry within a drive; odometry is multiplied by odometry_factor() on input, and the map by
/// map_factor() on output. So a change of the estimate never bends the map.
class RangeScale {
 public:
  /// Standard deviations of the scale of landmarks' distances and of odometry's (1e-3 = 1 mm per
  /// metre). Nothing is estimated where the first is 0.
  RangeScale(double range_sigma, double odometry_sigma)
      : range_sigma_(range_sigma), odometry_sigma_(odometry_sigma) {}

  /// The last one that add() accepted; none before the first.
  const std::optional<LocatedKeyframe>& last() const { return last_; }
  /// Adds the next one, with the unscaled odometry since last() (right perturbation); none if there
  /// is a gap. A motion that contradicts odometry is ignored.
  void add(const LocatedKeyframe& located,
           const std::optional<geometry::SE2WithCovariance>& odometry);
  /// The same estimate for a new map.
  RangeScale beside() const;
  /// The map in use was given: its scale is known.
  void hold() { is_held_ = true; }

  /// Units of the map per metre of odometry.
  double odometry_factor() const;
  /// Metres per unit of the map.
  double map_factor() const { return 1.0 / (1.0 + range_error()); }
  /// Standard deviation of map_factor().
  double sigma() const;

  /// Members of a saved state; see common/state. The priors are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.last_, self.products_, self.squares_, self.is_held_);
  }

 private:
  bool is_estimated() const { return range_sigma_ > 0.0 && !is_held_ && squares_ > 0.0; }
  double ratio_error() const { return products_ / squares_ - 1.0; }
  double ratio_variance() const { return 1.0 / squares_; }
  double range_error() const;

  double range_sigma_;
  double odometry_sigma_;
  std::optional<LocatedKeyframe> last_;
  double products_ = 0.0;  ///< Sum of (motion by landmarks * motion by odometry) / variance.
  double squares_ = 0.0;   ///< Sum of (motion by odometry)^2 / variance.
  bool is_held_ = false;
};

/// Position of a keyframe's last member from landmarks of the map, by a rigid fit without prior;
/// none with fewer than six. `positions_m`: of the associated landmarks, frame `map`.
std::optional<LocatedKeyframe> located_by_landmarks(
    const model::Keyframe& keyframe, std::span<const model::Association> associations,
    std::span<const Eigen::Vector2d> positions_m);

}  // namespace understory::geoslam_mapper::smoothing
