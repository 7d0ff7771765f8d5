// The keyframes of a drive; events of landmarks refer to them by number.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/model/map.hpp"
#include "common/story/ring.hpp"

namespace understory::story {

/// A stamp of events of landmarks; for a keyframe also its position.
struct Moment {
  model::Utime utime = 0;
  std::uint64_t keyframe = 0;           ///< Its sequence; valid if `placed` > 0.
  Eigen::Vector2d vehicle_m{0.0, 0.0};  ///< Position of the keyframe's base, frame map.
  std::uint32_t placed = 0;             ///< Number among the placed keyframes, from 1; 0 = none.
  model::MapUpdateStatus status = model::MapUpdateStatus::kRejected;

  /// Whether it has a keyframe's SLAM_UPDATE.
  bool has_keyframe() const { return placed > 0; }
};

/// The latest moments by number.
class Moments {
 public:
  /// Stores at most `limit` moments.
  explicit Moments(std::size_t limit) : moments_(limit) {}
  /// Adds a placed keyframe; returns its number.
  std::uint32_t add(const model::MapUpdate& update);
  /// Number of the latest moment with this stamp; adds one if the last 64 have other stamps. O(1).
  std::uint32_t at(model::Utime utime);
  /// The moment of this number; null if it was dropped.
  const Moment* find(std::uint32_t number) const;

  std::size_t bytes() const { return moments_.bytes(); }  ///< Memory held [bytes].

 private:
  std::uint32_t latest() const { return static_cast<std::uint32_t>(moments_.heard() - 1); }

  History<Moment> moments_;
  std::uint32_t placed_ = 0;
};

}  // namespace understory::story
