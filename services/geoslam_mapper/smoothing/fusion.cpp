#include "services/geoslam_mapper/smoothing/fusion.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "services/geoslam_mapper/smoothing/observation_noise.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Number of earlier landmarks of the map that ties a keyframe to it: two points determine a pose.
constexpr std::size_t kTie = 2;

/// chi^2 as a standard normal deviate (Wilson & Hilferty 1931).
double chi2_deviate(double chi2, double degrees_of_freedom) {
  const double spread = 2.0 / (9.0 * degrees_of_freedom);
  return (std::cbrt(chi2 / degrees_of_freedom) - (1.0 - spread)) / std::sqrt(spread);
}

/// The keyframe as observed from the node's centre: the common landmarks tie the two frames
/// together.
model::Keyframe in_frame_of(const geometry::SE2& node_T_keyframe, model::Keyframe keyframe) {
  const Eigen::Matrix2d rotation = node_T_keyframe.rotation();
  for (model::KeyframeLandmark& landmark : keyframe.landmarks) {
    landmark.position_m = node_T_keyframe * landmark.position_m;
    landmark.covariance_m2 = rotation * landmark.covariance_m2 * rotation.transpose();
  }
  for (model::KeyframeMember& member : keyframe.members)
    member.centre_T_vehicle = node_T_keyframe * member.centre_T_vehicle;
  return keyframe;
}

/// The pose of a node with observations from many passes is more accurate than that of one
/// keyframe: a keyframe of a new pass gets its own node, which may be removed later (KnownGround).
bool is_of_this_pass(NodeIndex node, const SmoothingMapperParameters& parameters,
                     const PoseGraph& graph) {
  if (parameters.known_ground_m <= 0.0) return true;
  return graph.node(*graph.newest()).along_m - graph.node(node).along_m <=
         parameters.known_ground_m;
}

/// Whether landmarks tie the keyframe to the node. Without them its pose is only predicted, and the
/// motion to the node would close a loop that was never observed.
bool holds(const Node& node, const Placement& placement) {
  const auto common = std::count_if(placement.associations.begin(), placement.associations.end(),
                                    [&](const model::Association& pair) {
                                      return node.observations().contains(pair.landmark_id);
                                    });
  return static_cast<std::size_t>(common) >= kHold;
}

/// The node for the keyframe, existing or new, and the keyframe in its frame.
FusedKeyframe enter(const model::Keyframe& arrived, const Placement& placement,
                    const SmoothingMapperParameters& parameters, GlobalMap& map) {
  const geometry::SE2& map_T_centre = placement.map_T_centre.mean;
  const auto revisited = map.trajectory.revisited(map_T_centre * middle_of(arrived), map.graph);
  const bool may_fold =
      revisited &&
      (is_of_this_pass(*revisited, parameters, map.graph) ||
       (map.trajectory.is_stationary(arrived) && holds(map.graph.node(*revisited), placement)));
  map.graph.checkpoint();

  FusedKeyframe fused;
  fused.associations = placement.associations;
  if (may_fold) {
    fused.node = *revisited;
    fused.keyframe = in_frame_of(map.graph.pose(*revisited).inverse() * map_T_centre, arrived);
  } else {
    fused.node = map.graph.add_node(map_T_centre, map.trajectory.is_stationary(arrived));
    fused.is_new_node = true;
    fused.keyframe = arrived;
  }
  return fused;
}

/// A landmark of a given map enters the graph with its prior at its first observation (GeoSLAM
/// §4.3.1).
void add_observations(const FusedKeyframe& fused, const SmoothingMapperParameters& parameters,
                      GlobalMap& map) {
  for (const model::Association& pair : fused.associations) {
    map.enter_given(pair.landmark_id);
    observe(fused.keyframe.landmarks[pair.keyframe_landmark], fused.node, pair.landmark_id,
            parameters, map);
  }
}

/// Adds up chi^2 of the associations that fit; returns the others.
std::set<model::LandmarkId> judge(FusedKeyframe& fused, double outlier_chi2,
                                  const PoseGraph& graph) {
  std::set<model::LandmarkId> outliers;
  for (const model::Association& pair : fused.associations) {
    const double error = graph.chi2(fused.node, pair.landmark_id);
    if (error > outlier_chi2) {
      outliers.insert(pair.landmark_id);
    } else {
      fused.chi2 += error;
      fused.degrees_of_freedom += 2;
    }
  }
  return outliers;
}

/// Solves, removes single associations that do not fit, and judges the rest. False with the reason
/// if the keyframe contradicts the map.
bool solve(FusedKeyframe& fused, const SmoothingMapperParameters& parameters, PoseGraph& graph) {
  factor_graph::plane::SmootherUpdate solved = graph.solve();
  fused.is_determined = solved.ok;
  if (!solved.ok) {
    fused.reason = solved.error;
    return false;
  }

  // Does the keyframe fit as a whole?
  const std::set<model::LandmarkId> outliers = judge(fused, parameters.outlier_chi2, graph);
  if (fused.degrees_of_freedom > 0 &&
      chi2_deviate(fused.chi2, fused.degrees_of_freedom) > parameters.max_innovation_sigmas) {
    fused.reason = "innovation too large for its covariance";
    return false;
  }
  if (2 * outliers.size() > fused.associations.size()) {
    fused.reason = "most associations do not fit";
    return false;
  }
  if (outliers.empty()) return true;

  // Removes the outliers.
  for (const model::LandmarkId id : outliers) graph.ignore(fused.node, id);
  std::erase_if(fused.associations, [&](const model::Association& pair) {
    return outliers.contains(pair.landmark_id);
  });
  solved = graph.solve();
  fused.is_determined = solved.ok;
  fused.reason = solved.error;
  return solved.ok;
}

/// Updates the landmarks' counts and sums of observations.
void count_observations(const FusedKeyframe& fused, GlobalMap& map) {
  for (const model::Association& pair : fused.associations) {
    const model::KeyframeLandmark& observed = fused.keyframe.landmarks[pair.keyframe_landmark];
    StoredLandmark& landmark = map.landmarks.at(pair.landmark_id);
    landmark.observation_count += observed.observation_count;
    landmark.last_keyframe = map.trajectory.size();
    landmark.information += 2.0 / observed.covariance_m2.trace();
    landmark.radius_m +=
        (observed.radius_m - landmark.radius_m) / static_cast<double>(landmark.nodes.size() + 1);
    landmark.observed_from(fused.node);
    landmark.viewed_at(map.graph.node(fused.node).along_m);
  }
}

/// Adds the keyframe to the solved graph and condenses the stretch. Unless the result is `ok`, the
/// graph is unchanged.
FusedKeyframe attempt(const model::Keyframe& arrived, const Placement& placement,
                      const Motion& motion, const SmoothingMapperParameters& parameters,
                      std::span<const NodeIndex> stretch, GlobalMap& map) {
  FusedKeyframe fused = enter(arrived, placement, parameters, map);
  add_observations(fused, parameters, map);
  if (const auto driven = motion.since_last_centre(fused.keyframe))
    map.graph.add_motion(*driven, fused.node);
  fused.took_stretch = !stretch.empty() && std::ranges::find(stretch, fused.node) == stretch.end();
  if (fused.took_stretch) fused.condensed = map.graph.condense(stretch);

  fused.ok = solve(fused, parameters, map.graph);
  if (!fused.ok) map.graph.rollback();
  return fused;
}

}  // namespace

FusedKeyframe fuse(const model::Keyframe& arrived, const Placement& placement, const Motion& motion,
                   const SmoothingMapperParameters& parameters, std::span<const NodeIndex> stretch,
                   GlobalMap& map) {
  FusedKeyframe fused = attempt(arrived, placement, motion, parameters, stretch, map);
  if (!fused.is_determined && !fused.condensed.empty()) {
    // The keyframe may fit the nodes of the stretch but not the condensed node.
    fused = attempt(arrived, placement, motion, parameters, {}, map);
    fused.took_stretch = true;
  }
  if (!fused.ok) {
    fused.associations.clear();
    fused.condensed.clear();
    return fused;
  }

  if (fused.associations.size() < kTie) map.trajectory.tear();
  map.trajectory.add(base_of(fused.keyframe, fused.node), map.graph);
  count_observations(fused, map);
  map.adopt_estimates();
  return fused;
}

}  // namespace understory::geoslam_mapper::smoothing
