#include "eval/baselines/keyframer/observation.hpp"

#include "eval/baselines/hierarchy/matching.hpp"

namespace understory::eval::baselines::keyframer {

Observation make_observation(const model::LandmarkScan& scan, std::uint64_t number,
                             double descriptor_step) {
  Observation observation;
  observation.number = number;
  observation.utime = scan.utime;
  observation.sequence = scan.sequence;
  observation.field_of_view = scan.field_of_view;

  for (const model::Detection& detection : scan.detections) {
    observation.points.emplace_back(detection.position_m.head<2>());
    observation.radii_m.push_back(detection.radius_m);
    observation.kinds.push_back(detection.kind);
  }

  observation.hierarchy = hierarchy::Hierarchy(observation.points, descriptor_step);
  return observation;
}

std::optional<hierarchy::Similarity> align(const Observation& from, const Observation& to,
                                           const AlignmentParameters& parameters) {
  const hierarchy::MatchingParameters matching{parameters.max_descriptor_distance,
                                               parameters.max_side_difference,
                                               parameters.min_triangle_match_ratio};

  // Matched landmarks that have hardly moved between the two scans.
  std::vector<Eigen::Vector2d> from_points;
  std::vector<Eigen::Vector2d> to_points;
  for (const hierarchy::PointMatch& match :
       match_hierarchies(from.hierarchy, to.hierarchy, matching)) {
    const Eigen::Vector2d& p = from.points[match.local];
    const Eigen::Vector2d& q = to.points[match.other];
    if ((p - q).cwiseAbs().maxCoeff() < parameters.max_distance_m) {
      from_points.push_back(p);
      to_points.push_back(q);
    }
  }

  if (static_cast<int>(from_points.size()) < parameters.min_associations) {
    return std::nullopt;
  }
  return hierarchy::fit_similarity(from_points, to_points);
}

}  // namespace understory::eval::baselines::keyframer
