// Rebuilds the full graph of a drive from the factors of its stretches.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "common/factor_graph/plane/graph.hpp"
#include "common/model/map.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/stretch.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Maps earlier ids of landmarks to present ones.
class LandmarkAliases {
 public:
  /// Adds merges, old -> new, later than all added before.
  void add(std::span<const std::pair<model::LandmarkId, model::LandmarkId>> merged);
  /// The landmark that now has the observations of this one.
  model::LandmarkId operator()(model::LandmarkId id) const;

 private:
  std::map<model::LandmarkId, model::LandmarkId> newer_;
};

/// A stretch and the pose of its origin, frame `map`: an initial guess.
struct PlacedStretch {
  const Stretch* stretch = nullptr;
  geometry::SE2 map_T_origin;
};

/// The graph of a drive as if it had never been condensed.
struct ExpandedDrive {
  /// A keyframe, tied to a pose.
  struct Keyframe {
    std::uint64_t sequence = 0;
    model::Utime utime = 0;
    factor_graph::plane::PoseId pose{};
    geometry::SE2 pose_T_base;
  };
  factor_graph::plane::Graph graph;          ///< Poses in the order given.
  std::vector<Keyframe> keyframes;           ///< In order of time.
  std::vector<std::size_t> stretch_of_pose;  ///< Index in the stretches given.
  std::vector<std::uint32_t> scans_of_pose;  ///< Of its first keyframe.

  /// map_T_base of each keyframe at the graph's values.
  std::vector<model::KeyframePose> trajectory() const;
};

/// Builds the full graph of a drive (thesis on submaps §2.3.3: the submaps are expanded, and the
/// full graph is optimised with the approximate solution as initial estimate). Each stretch has its
/// own gyro bias, tied to the previous one by the random walk of `parameters`. Node 0, the origin
/// of the map, must be in a stretch: it is held fixed. Not in the graph: external loop closures,
/// and observations that condensed nodes got from nodes removed on known ground. O(factors).
ExpandedDrive expand(std::span<const PlacedStretch> stretches, const LandmarkAliases& aliases,
                     const SmoothingMapperParameters& parameters);

/// Moves the drive to its optimum. Observations that then contradict it by more than
/// `outlier_chi2`, as after a merge that was undone, are removed. Returns false without change if
/// the factors leave a variable undetermined. Cost: some factorisations of the whole.
bool settle(ExpandedDrive& drive, const SmoothingMapperParameters& parameters);

}  // namespace understory::geoslam_mapper::smoothing
