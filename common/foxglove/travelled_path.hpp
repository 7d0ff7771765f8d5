// The path so far, as a bounded number of poses.
#pragma once

#include <cstdint>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/slam_output.hpp"

namespace understory::foxglove {

/// Poses at least 0.5 m apart; when there are too many, every second one is removed and the
/// distance doubles. The path always covers the whole drive, with less detail on a longer one.
class TravelledPath {
 public:
  /// A path of at most `most_poses` (2 or more).
  explicit TravelledPath(std::size_t most_poses) : most_(most_poses) {}

  /// Takes a valid pose; another map starts another path. True where poses() has changed.
  bool add(const model::SlamPose& pose);
  /// Poses in order of time, frame map.
  const std::vector<geometry::SE2>& poses() const { return poses_; }

 private:
  std::size_t most_;
  double spacing_m_ = 0.5;
  std::uint32_t map_id_ = 0;
  std::vector<geometry::SE2> poses_;
};

}  // namespace understory::foxglove
