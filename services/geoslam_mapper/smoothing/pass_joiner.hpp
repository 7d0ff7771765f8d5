// Joins the landmarks of an earlier pass and of this one.
#pragma once

#include <optional>
#include <vector>

#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Result of a join.
struct JoinedPasses {
  std::vector<MergedPair> pairs;         ///< Landmarks that were merged.
  std::vector<model::LandmarkId> moved;  ///< Landmarks that moved with them.
};

/// A place of this pass at which the search found no landmarks of another one.
struct WaitingPlace {
  double along_m = 0.0;                                  ///< Path length.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< In the map, at the time of the pass.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.along_m, self.position_m);
  }
};

/// Searches for the landmarks of this pass among those of earlier ones, while tracking continues.
/// After drift, landmarks that come into view again lie metres beside their map positions: each
/// alone is ambiguous, but all together fit at one pose only. The search covers the graph's
/// uncertainty between the two passes (see match_passes()). The pairs are merged; if the graph
/// contradicts the merge, it is rolled back exactly. A place without a result is searched again
/// after a later join, when the distance is known better.
class PassJoiner {
 public:
  /// `parameters` gives the gates.
  explicit PassJoiner(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// Call it after each accepted keyframe. The graph is solved if passes were joined. Cost: nothing
  /// if no other pass is near or its landmarks are already tied to the vehicle's pose; else one
  /// search among the landmarks around every few metres, and after a join one per keyframe at the
  /// waiting places (64 at most).
  JoinedPasses follow(const model::FieldOfView& field_of_view, NodeIndex newest, Merges& merges,
                      GlobalMap& map);

  /// Merges each pair and solves: all pairs, or none if the graph contradicts them. The pairs are
  /// ordered as by Merges::in_order().
  JoinedPasses join(std::vector<MergedPair> pairs, Merges& merges, GlobalMap& map) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.tried_m_, self.places_, self.to_try_);
  }

 private:
  JoinedPasses try_again(const model::FieldOfView& field_of_view, Merges& merges, GlobalMap& map);
  JoinedPasses join_at(const model::FieldOfView& field_of_view, NodeIndex node, Merges& merges,
                       GlobalMap& map, bool& might) const;

  SmoothingMapperParameters parameters_;
  double tried_m_ = 0.0;              ///< Path length of the vehicle at the last search.
  std::vector<WaitingPlace> places_;  ///< In order of path length.
  std::size_t to_try_ = 0;            ///< The first `to_try_` places are searched again.
};

}  // namespace understory::geoslam_mapper::smoothing
