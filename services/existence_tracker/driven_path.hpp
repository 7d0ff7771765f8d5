// Path of the vehicle since the tracker began.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>

#include "common/model/archive.hpp"

namespace understory::existence_tracker {

/// Path length from the keyframes' positions, and the current pass: a pass is a way through a
/// place; after a given path length the next one begins.
class DrivenPath {
 public:
  /// The next keyframe's position, frame map.
  void drive_to(const Eigen::Vector2d& place_m) {
    if (place_m_) along_m_ += std::min(kLongestStep_m, (place_m - *place_m_).norm());
    place_m_ = place_m;
  }
  /// A pass begins here.
  void begin_pass() { pass_began_m_ = along_m_; }

  /// Path so far [m].
  double along_m() const { return along_m_; }
  /// Path of the current pass [m].
  double of_pass_m() const { return along_m_ - pass_began_m_; }
  /// Of the last keyframe, frame map; the origin before the first.
  Eigen::Vector2d place_m() const { return place_m_.value_or(Eigen::Vector2d::Zero()); }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.place_m_, self.along_m_, self.pass_began_m_);
  }

 private:
  /// A longer step between two keyframes is a correction of the map.
  static constexpr double kLongestStep_m = 50.0;

  std::optional<Eigen::Vector2d> place_m_;
  double along_m_ = 0.0;
  double pass_began_m_ = 0.0;
};

}  // namespace understory::existence_tracker
