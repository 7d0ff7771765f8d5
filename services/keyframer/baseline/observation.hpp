// A scan while the source's keyframer holds it.
#pragma once

#include <optional>
#include <vector>

#include "common/hierarchy/baseline/hierarchy.hpp"
#include "common/hierarchy/baseline/similarity.hpp"
#include "common/model/landmarks.hpp"

namespace understory::keyframer::baseline {

struct Observation {
  std::uint64_t number = 0;  ///< Counts scans, used and unused.
  model::Utime utime = 0;
  std::uint64_t sequence = 0;
  model::FieldOfView field_of_view;
  std::vector<Eigen::Vector2d> points;  ///< Frame of the vehicle [m].
  std::vector<double> radii_m;
  std::vector<model::LandmarkKind> kinds;
  hierarchy::baseline::Hierarchy hierarchy;
  /// Once it is in a keyframe: vehicle to base.
  hierarchy::baseline::Similarity base_T_vehicle;
  bool is_base = false;
};

Observation make_observation(const model::LandmarkScan& scan, std::uint64_t number,
                             double descriptor_step);

struct AlignmentParameters {
  double max_descriptor_distance = 9.0;   ///< [tau]
  int max_side_difference = 3;            ///< [Delta_N]
  double min_triangle_match_ratio = 0.5;  ///< [eta]
  int min_associations = 7;               ///< [gamma]
  double max_distance_m = 1.0;            ///< [lambda]
};

/// Least-squares similarity that takes `from` to `to`, over landmarks that match and lie within
/// `max_distance_m` [lambda] per axis in the two vehicles' frames; none with fewer than
/// `min_associations` [gamma] of them. (The thesis asks for more than gamma, the code for gamma.)
std::optional<hierarchy::baseline::Similarity> align(const Observation& from, const Observation& to,
                                                     const AlignmentParameters& parameters);

}  // namespace understory::keyframer::baseline
