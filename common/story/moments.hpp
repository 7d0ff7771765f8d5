// The keyframes of a drive, to which everything that happens to landmarks refers by number.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/model/map.hpp"
#include "common/story/ring.hpp"

namespace understory::story {

/// A stamp at which something happened to landmarks; of a keyframe, where it was.
struct Moment {
  model::Utime utime = 0;
  std::uint64_t keyframe = 0;           ///< Its sequence; where `placed` > 0.
  Eigen::Vector2d vehicle_m{0.0, 0.0};  ///< Of the keyframe's base, frame map.
  std::uint32_t placed = 0;             ///< Number among the placed keyframes, from 1; 0 = none.
  model::MapUpdateStatus status = model::MapUpdateStatus::kRejected;

  /// Whether a keyframe's SLAM_UPDATE came with it.
  bool has_keyframe() const { return placed > 0; }
};

/// The latest moments by number.
class Moments {
 public:
  /// Keeps so many.
  explicit Moments(std::size_t limit) : moments_(limit) {}
  /// A placed keyframe; gives its number.
  std::uint32_t add(const model::MapUpdate& update);
  /// Number of the latest moment of this stamp; a new one where the last 64 have another. O(1).
  std::uint32_t at(model::Utime utime);
  /// The moment of this number; null where it had to go.
  const Moment* find(std::uint32_t number) const;

  std::size_t bytes() const { return moments_.bytes(); }  ///< Held.

 private:
  std::uint32_t latest() const { return static_cast<std::uint32_t>(moments_.heard() - 1); }

  History<Moment> moments_;
  std::uint32_t placed_ = 0;
};

}  // namespace understory::story
