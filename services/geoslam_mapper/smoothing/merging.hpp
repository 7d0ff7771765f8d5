// One landmark for one trunk: what is found to be the same is joined, what is not is separated.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "services/geoslam_mapper/smoothing/fusion.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"
#include "services/geoslam_mapper/smoothing/pass_joiner.hpp"

namespace understory::geoslam_mapper::smoothing {

/// What a keyframe made one, and what it separated.
struct MergingResult {
  std::vector<MergedPair> merged;
  std::optional<model::LandmarkId> separated;  ///< A new landmark.
};

/// After each keyframe: separates what its observations contradict most, joins this pass with
/// earlier ones, and merges doubles around what the keyframe observed and what a joined pass moved.
class Merging {
 public:
  /// `parameters` gives the gates and the distance within which doubles are looked for.
  explicit Merging(const SmoothingMapperParameters& parameters)
      : parameters_(parameters), pass_joiner_(parameters) {}

  /// `touched`: the associations of the keyframe that was fused. Cost: what is around it.
  MergingResult follow(const FusedKeyframe& fused, std::span<const model::Association> touched,
                       GlobalMap& map);

  /// Makes the pairs one, all or none; see PassJoiner::join(). What moves is looked at later.
  std::vector<MergedPair> join(std::vector<MergedPair> pairs, GlobalMap& map);

  /// What was merged so far, for nodes that are taken out.
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
  std::vector<model::LandmarkId> waiting_;  ///< Moved by a joined pass, not looked at yet.
};

}  // namespace understory::geoslam_mapper::smoothing
