// One landmark per trunk: merges doubles and separates wrong merges.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "services/geoslam_mapper/smoothing/fusion.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"
#include "services/geoslam_mapper/smoothing/pass_joiner.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Landmarks that a keyframe merged and separated.
struct MergingResult {
  std::vector<MergedPair> merged;
  std::optional<model::LandmarkId> separated;  ///< A new landmark.
};

/// After each keyframe: separates the landmark with the strongest contradiction, joins this pass
/// with earlier ones, and merges doubles around the observed landmarks and around those that a join
/// moved.
class Merging {
 public:
  /// `parameters` gives the gates and the search radius for doubles.
  explicit Merging(const SmoothingMapperParameters& parameters)
      : parameters_(parameters), pass_joiner_(parameters) {}

  /// `touched`: the associations of the fused keyframe. Cost: the landmarks around it.
  MergingResult follow(const FusedKeyframe& fused, std::span<const model::Association> touched,
                       GlobalMap& map);

  /// Merges all the pairs or none; see PassJoiner::join(). Moved landmarks are checked at later
  /// keyframes.
  std::vector<MergedPair> join(std::vector<MergedPair> pairs, GlobalMap& map);

  /// The merges so far, for nodes that leave the graph.
  Merges& merges() { return merges_; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.merges_, self.pass_joiner_, self.waiting_);
  }

 private:
  std::vector<model::LandmarkId> to_look_at(std::span<const model::Association> touched);

  SmoothingMapperParameters parameters_;
  Merges merges_;
  PassJoiner pass_joiner_;
  std::vector<model::LandmarkId> waiting_;  ///< Moved by a join, not checked yet.
};

}  // namespace understory::geoslam_mapper::smoothing
