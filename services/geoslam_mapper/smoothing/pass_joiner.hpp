// What an earlier pass and this one saw of the same landmarks, joined.
#pragma once

#include <optional>
#include <vector>

#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Passes that were joined.
struct JoinedPasses {
  std::vector<MergedPair> pairs;         ///< Landmarks that became one.
  std::vector<model::LandmarkId> moved;  ///< What moved with them.
};

/// A place of this pass where another one's landmarks were not found.
struct WaitingPlace {
  double along_m = 0.0;                                  ///< On the way.
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< In the map, when it was passed.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.along_m, self.position_m);
  }
};

/// Looks for the landmarks of this pass among those of earlier ones, while tracking goes on. After
/// a way on which the pose drifted, what comes into view again lies metres beside what the map has:
/// each landmark may be any of several, but all together have one place only. Found is it within
/// what the graph knows of the distance of the two passes (see match_passes()); the pairs become
/// one landmark each, and where the graph contradicts that, all of it is taken back exactly. Where
/// nothing is found the place waits: behind a later join its distance is known better.
class PassJoiner {
 public:
  /// `parameters` gives the gates.
  explicit PassJoiner(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// To be called after each accepted keyframe. The graph is solved where passes were joined. Cost:
  /// nothing where no other pass is near or its landmarks are bound to the vehicle's pose; else,
  /// every few metres, one search among the landmarks around, and after a join one for each
  /// keyframe at the places that wait (64 at most).
  JoinedPasses follow(const model::FieldOfView& field_of_view, NodeIndex newest, Merges& merges,
                      GlobalMap& map);

  /// Makes each pair one landmark and solves: all pairs, or none where the graph contradicts them.
  /// The landmarks that count as one come first and second as Merges::in_order() gives them.
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
  double tried_m_ = 0.0;              ///< Path of the vehicle at the last search.
  std::vector<WaitingPlace> places_;  ///< In order of the way.
  std::size_t to_try_ = 0;            ///< The first so many of them are tried again.
};

}  // namespace understory::geoslam_mapper::smoothing
