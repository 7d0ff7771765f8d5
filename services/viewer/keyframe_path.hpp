// The smoothed path: keyframes at their latest poses.
#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "common/model/map.hpp"
#include "services/viewer/track.hpp"

namespace understory::viewer {

/// Keyframes in the order in which they were first heard of.
class KeyframePath {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit KeyframePath(Change& changes) : track_(changes) {}

  /// Takes poses of keyframes, new or known. O(given), and what lies behind the first that moved
  /// is told to the page again.
  void take(std::span<const model::KeyframePose> keyframes);
  /// Where a keyframe's base is; none where it is not known.
  std::optional<geometry::SE2> find(std::uint64_t keyframe_sequence) const;
  /// Nothing is known.
  void clear();
  /// For the page.
  const Track& track() const { return track_; }

 private:
  Track track_;
  std::unordered_map<std::uint64_t, std::size_t> index_of_;
  std::vector<TrackPoint> points_;
};

}  // namespace understory::viewer
