// A scan while the thesis's keyframer holds it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/model/landmarks.hpp"
#include "eval/baselines/hierarchy/hierarchy.hpp"
#include "eval/baselines/hierarchy/similarity.hpp"

namespace understory::eval::baselines::keyframer {

/// [thisObs] of GeoSLAM algorithm 2: the landmarks of one scan with their geometric hierarchy.
struct Observation {
  std::uint64_t number = 0;  ///< [id] Counts scans, used and unused.
  model::Utime utime = 0;
  std::uint64_t sequence = 0;  ///< Of the LANDMARKS message.
  model::FieldOfView field_of_view;
  std::vector<Eigen::Vector2d> points;     ///< [cloud] Frame of the vehicle, m.
  std::vector<double> radii_m;             ///< Of each point; 0 where unknown.
  std::vector<model::LandmarkKind> kinds;  ///< Of each point.
  hierarchy::Hierarchy hierarchy;
  /// [tf] Valid once the scan is in a keyframe.
  hierarchy::Similarity base_T_vehicle;
  bool is_base = false;  ///< Its frame is the keyframe's.
};

/// The observation of a scan; builds its hierarchy. `descriptor_step`: [s] of the perimeter.
Observation make_observation(const model::LandmarkScan& scan, std::uint64_t number,
                             double descriptor_step);

/// Thresholds of align(), from the service's parameters; symbols of the thesis (GeoSLAM Table 4.2)
/// in brackets.
struct AlignmentParameters {
  double max_descriptor_distance = 0.0;   ///< [tau]
  int max_side_difference = 0;            ///< [Delta_N]
  double min_triangle_match_ratio = 0.0;  ///< [eta]
  int min_associations = 0;               ///< [gamma]
  double max_distance_m = 0.0;            ///< [lambda]
};

/// Least-squares similarity to_T_from over landmarks that match and lie within `max_distance_m`
/// [lambda] per axis in the two vehicles' frames (GeoSLAM §4.2.1). Nothing with fewer than
/// `min_associations` [gamma] of them: the thesis asks for more than gamma, its code for gamma.
std::optional<hierarchy::Similarity> align(const Observation& from, const Observation& to,
                                           const AlignmentParameters& parameters);

}  // namespace understory::eval::baselines::keyframer
