#include "services/geoslam_mapper/smoothing/discovery.hpp"

#include <algorithm>
#include <cmath>

#include "services/geoslam_mapper/smoothing/observation_noise.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Added to the gate in which an observation belongs to a candidate [m].
constexpr double kCandidateFloor_m = 0.1;

std::uint32_t members_in_view(const model::Keyframe& keyframe,
                              const Eigen::Vector2d& position_in_centre) {
  std::uint32_t count = 0;
  for (const model::KeyframeMember& member : keyframe.members) {
    if (keyframe.field_of_view.contains(member.centre_T_vehicle.inverse() * position_in_centre))
      ++count;
  }
  return count;
}

}  // namespace

std::vector<model::Association> Discovery::update(const model::Keyframe& keyframe, NodeIndex node,
                                                  std::span<const model::Association> known,
                                                  GlobalMap& map) {
  std::vector<bool> is_known(keyframe.landmarks.size(), false);
  for (const model::Association& pair : known) is_known[pair.keyframe_landmark] = true;
  const geometry::SE2 map_T_centre = map.graph.pose(node);
  follow(keyframe, map_T_centre.inverse(), map.graph);

  std::vector<model::Association> found;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (is_known[i]) continue;
    const model::KeyframeLandmark& observed = keyframe.landmarks[i];
    const Eigen::Vector2d position = map_T_centre * observed.position_m;

    // The matching candidate, or a new one.
    Candidate* candidate = matching(position, observed);
    if (candidate == nullptr) {
      candidates_.push_back({position,
                             {},
                             0,
                             members_in_view(keyframe, observed.position_m),
                             map.trajectory.size(),
                             observed.kind});
      candidate = &candidates_.back();
    }
    if (!candidate->observations.empty() && candidate->observations.back().node == node) continue;

    // Adds the observation.
    candidate->observations.push_back({node, observed});
    candidate->observation_count += observed.observation_count;
    candidate->position_m = position;
    if (!is_confirmed(*candidate)) continue;

    // Promotes a confirmed candidate.
    found.push_back({static_cast<std::uint32_t>(i), promote(*candidate, map)});
    candidates_.erase(candidates_.begin() + (candidate - candidates_.data()));
  }
  forget_stale(map.trajectory.size());
  return found;
}

/// Updates the candidates' positions from the graph, and their numbers of expected detections.
void Discovery::follow(const model::Keyframe& keyframe, const geometry::SE2& centre_T_map,
                       const PoseGraph& graph) {
  for (Candidate& candidate : candidates_) {
    const Candidate::Observation& latest = candidate.observations.back();
    candidate.position_m = graph.pose(latest.node) * latest.landmark.position_m;
    candidate.times_in_view += members_in_view(keyframe, centre_T_map * candidate.position_m);
  }
}

/// Observed often enough, and in a sufficient share of the scans with it in view: this excludes
/// clutter and noise at the edge of the range.
bool Discovery::is_confirmed(const Candidate& candidate) const {
  return candidate.observation_count >= static_cast<std::uint32_t>(parameters_.min_observations) &&
         candidate.observation_count >= parameters_.min_observation_ratio * candidate.times_in_view;
}

Discovery::Candidate* Discovery::matching(const Eigen::Vector2d& position_m,
                                          const model::KeyframeLandmark& observed) {
  const double sigma = std::sqrt(0.5 * observed.covariance_m2.trace());
  double best = parameters_.gate_sigmas * std::sqrt(2.0) * sigma + kCandidateFloor_m;
  Candidate* result = nullptr;
  for (Candidate& candidate : candidates_) {
    const double distance = (candidate.position_m - position_m).norm();
    if (candidate.kind != observed.kind || distance >= best) continue;
    best = distance;
    result = &candidate;
  }
  return result;
}

model::LandmarkId Discovery::promote(const Candidate& candidate, GlobalMap& map) const {
  // Mean of its observations.
  StoredLandmark landmark;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Candidate::Observation& observation : candidate.observations) {
    const double weight = 2.0 / observation.landmark.covariance_m2.trace();
    sum += weight * (map.graph.pose(observation.node) * observation.landmark.position_m);
    landmark.information += weight;
    landmark.radius_m +=
        observation.landmark.radius_m / static_cast<double>(candidate.observations.size());
    landmark.observed_from(observation.node);
    landmark.viewed_at(map.graph.node(observation.node).along_m);
  }
  landmark.position_m = sum / landmark.information;
  landmark.observation_count = candidate.observation_count;
  landmark.last_keyframe = map.trajectory.size();
  landmark.kind = candidate.kind;

  // Adds it to the map, then to the graph with all its observations.
  const model::LandmarkId id = map.landmarks.insert(landmark);
  map.graph.add_landmark(id, landmark.position_m, std::nullopt);
  for (const Candidate::Observation& observation : candidate.observations)
    observe(observation.landmark, observation.node, id, parameters_, map);
  return id;
}

void Discovery::hand_over(const Retirement& retirement) {
  const geometry::SE2& into_T_node = retirement.into_T_node.mean;
  for (Candidate& candidate : candidates_) {
    for (Candidate::Observation& observation : candidate.observations) {
      if (observation.node != retirement.node) continue;
      observation.node = retirement.into;
      model::KeyframeLandmark& landmark = observation.landmark;
      landmark.position_m = into_T_node * landmark.position_m;
      landmark.covariance_m2 =
          into_T_node.rotation() * landmark.covariance_m2 * into_T_node.rotation().transpose();
    }
  }
}

void Discovery::forget_stale(std::uint32_t keyframes) {
  std::erase_if(candidates_, [&](const Candidate& candidate) {
    return candidate.first_keyframe + static_cast<std::uint32_t>(parameters_.candidate_keyframes) <
           keyframes;
  });
}

}  // namespace understory::geoslam_mapper::smoothing
