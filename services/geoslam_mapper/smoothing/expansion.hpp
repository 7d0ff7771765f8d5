// A drive put together again from the factors of its stretches.
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

/// Which landmark an id of earlier stands for now.
class LandmarkAliases {
 public:
  /// These were merged, old -> new, after all that was told before.
  void add(std::span<const std::pair<model::LandmarkId, model::LandmarkId>> merged);
  /// The landmark that has the observations of this one.
  model::LandmarkId operator()(model::LandmarkId id) const;

 private:
  std::map<model::LandmarkId, model::LandmarkId> newer_;
};

/// A stretch and where its origin is, frame `map`: a first guess.
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

/// Puts a drive together (thesis on submaps §2.3.3: the submaps are expanded, and the full graph is
/// optimised with the approximate solution as initial estimate). Each stretch has a bias of the
/// gyro of its own, tied to the one before by the random walk of `parameters`. The node that holds
/// the map, number 0, must be in a stretch: it is held where it is. Not in the graph: loop closures
/// from outside, and what nodes that were taken out on known ground gave to condensed ones.
/// O(factors).
ExpandedDrive expand(std::span<const PlacedStretch> stretches, const LandmarkAliases& aliases,
                     const SmoothingMapperParameters& parameters);

/// Moves the drive to its optimum. Observations that contradict it then by more than
/// `outlier_chi2`, as after a merge that was taken back, are taken out. False, and nothing is
/// changed, where the factors leave a variable undetermined. Costs some factorisations of the
/// whole.
bool settle(ExpandedDrive& drive, const SmoothingMapperParameters& parameters);

}  // namespace understory::geoslam_mapper::smoothing
