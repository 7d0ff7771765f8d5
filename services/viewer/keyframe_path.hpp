// The smoothed path: keyframes at their latest poses.
#pragma once

#include <span>
#include <unordered_map>
#include <vector>

#include "common/model/map.hpp"
#include "services/viewer/track.hpp"

namespace understory::viewer {

/// Keyframes in the order in which they were first received.
class KeyframePath {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit KeyframePath(Change& changes) : track_(changes) {}

  /// Adds or updates poses of keyframes. O(given); the path is sent to the page again from the
  /// first moved keyframe on.
  void take(std::span<const model::KeyframePose> keyframes);
  /// Pose of a keyframe's base; none if it is unknown.
  std::optional<geometry::SE2> find(std::uint64_t keyframe_sequence) const;
  /// Removes all keyframes.
  void clear();
  /// For the page.
  const Track& track() const { return track_; }

 private:
  Track track_;
  std::unordered_map<std::uint64_t, std::size_t> index_of_;
  std::vector<TrackPoint> points_;
};

}  // namespace understory::viewer
