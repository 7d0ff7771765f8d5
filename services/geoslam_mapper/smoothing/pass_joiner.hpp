// What an earlier pass and this one saw of the same landmarks, joined.
#pragma once

#include <optional>
#include <vector>

#include "common/constellation/localisation.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/merges.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Passes that were joined.
struct JoinedPasses {
  std::vector<MergedPair> pairs;         ///< Landmarks that became one.
  std::vector<model::LandmarkId> moved;  ///< What moved with them.
};

/// Looks for the landmarks of this pass among those of earlier ones, while tracking goes on. After
/// a way on which the pose drifted, what comes into view again lies metres beside what the map has:
/// each landmark may be any of several, but all together have one place only. Found is it by the
/// constellation of the landmarks around the vehicle (or by gates where these are narrower than the
/// landmarks stand apart), within what the graph knows of the distance of the two passes; the pairs
/// become one landmark each, and where the graph contradicts that, all of it is taken back exactly.
class PassJoiner {
 public:
  /// Sigmas of the distance of two passes within which they are looked for, and the furthest [m].
  static constexpr double kReach_sigmas = 4.0;
  static constexpr double kFurthest_m = 300.0;

  /// `parameters` gives the gates.
  explicit PassJoiner(const SmoothingMapperParameters& parameters) : parameters_(parameters) {}

  /// To be called after each accepted keyframe. The graph is solved where passes were joined. Cost:
  /// nothing where no other pass is near or its landmarks are bound to the vehicle's pose; else,
  /// every few metres, one search among the landmarks around.
  JoinedPasses follow(const model::FieldOfView& field_of_view, NodeIndex newest, Merges& merges,
                      GlobalMap& map);

  /// Makes each pair one landmark and solves: all pairs, or none where the graph contradicts them.
  /// The landmarks that count as one come first and second as Merges::in_order() gives them.
  JoinedPasses join(std::vector<MergedPair> pairs, Merges& merges, GlobalMap& map) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.tried_m_);
  }

 private:
  /// An earlier pass near by, and where it is to the newest node by the graph.
  struct EarlierPass {
    NodeIndex node = 0;
    geometry::SE2WithCovariance node_T_newest;
    double sigma_m = 0.0;  ///< Of the newest node's position, larger axis.
  };
  /// The landmarks around the newest node: of this pass, and of earlier ones.
  struct Scene {
    std::vector<model::LandmarkId> ours;
    std::vector<model::LandmarkId> theirs;
    double reach_m = 0.0;  ///< How far around.
  };
  /// Where the newest node is among the landmarks of earlier passes, and which are which.
  struct Match {
    geometry::SE2WithCovariance map_T_newest;
    std::vector<MergedPair> pairs;  ///< Ours, theirs.
  };
  std::optional<EarlierPass> earlier_pass(const model::FieldOfView& field_of_view, NodeIndex newest,
                                          const GlobalMap& map) const;
  Scene scene_around(const model::FieldOfView& field_of_view, NodeIndex newest,
                     const EarlierPass& pass, const GlobalMap& map) const;
  std::vector<MergedPair> find(const Scene& scene, NodeIndex newest, const EarlierPass& pass,
                               const GlobalMap& map) const;
  std::optional<Match> match_by_gates(const Scene& scene, NodeIndex newest, const EarlierPass& pass,
                                      const GlobalMap& map) const;
  std::optional<Match> match_by_constellation(const Scene& scene, NodeIndex newest,
                                              const EarlierPass& pass, const GlobalMap& map) const;
  SmoothingMapperParameters parameters_;
  double tried_m_ = 0.0;  ///< Path of the vehicle at the last search.
};

}  // namespace understory::geoslam_mapper::smoothing
