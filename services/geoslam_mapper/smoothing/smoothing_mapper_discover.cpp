// New landmarks (in the place of algorithm 5), and pairs of landmarks that turn out to be one.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Whether places saw the two side by side. Two that really stand so near to each other are seen
/// together from almost everywhere; one that a bad scan doubled is so once.
bool are_seen_together(const StoredLandmark& a, const StoredLandmark& b) {
  std::vector<NodeIndex> common;
  std::set_intersection(a.nodes.begin(), a.nodes.end(), b.nodes.begin(), b.nodes.end(),
                        std::back_inserter(common));
  return common.size() > 1 || 4 * common.size() > std::min(a.nodes.size(), b.nodes.size());
}

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

/// Every landmark of the keyframe that was not recognised becomes a candidate, or a further
/// sighting of one. A candidate with enough sightings enters the map with all of them: nothing that
/// was measured is lost.
void SmoothingMapper::discover(const model::Keyframe& keyframe, NodeIndex node,
                               model::MapUpdate& update) {
  std::vector<bool> known(keyframe.landmarks.size(), false);
  for (const model::Association& pair : update.associations) known[pair.keyframe_landmark] = true;
  const geometry::SE2 map_T_centre = smoother_.pose(nodes_[node].centre);
  const geometry::SE2 centre_T_map = map_T_centre.inverse();
  for (Candidate& candidate : candidates_) {
    const Candidate::Observation& latest = candidate.observations.back();
    candidate.position_m = smoother_.pose(nodes_[latest.node].centre) * latest.landmark.position_m;
    candidate.times_in_view += members_in_view(keyframe, centre_T_map * candidate.position_m);
  }
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (known[i]) continue;
    const model::KeyframeLandmark& seen = keyframe.landmarks[i];
    const Eigen::Vector2d position = map_T_centre * seen.position_m;
    Candidate* candidate = matching_candidate(position, seen);
    if (candidate == nullptr) {
      candidates_.push_back(
          {position, {}, 0, members_in_view(keyframe, seen.position_m), keyframes_, seen.kind});
      candidate = &candidates_.back();
    }
    if (!candidate->observations.empty() && candidate->observations.back().node == node) continue;
    candidate->observations.push_back({node, seen});
    candidate->observation_count += seen.observation_count;
    candidate->position_m = position;
    if (!believable(*candidate)) continue;
    promote(*candidate, update);
    update.associations.push_back({static_cast<std::uint32_t>(i), update.added.back()});
    candidates_.erase(candidates_.begin() + (candidate - candidates_.data()));
  }
  forget_stale_candidates();
}

/// Seen often enough, and in a fair share of the scans that should have seen it: what noise brings
/// into range now and then, or clutter makes, is not.
bool SmoothingMapper::believable(const Candidate& candidate) const {
  return candidate.observation_count >= static_cast<std::uint32_t>(parameters_.min_observations) &&
         candidate.observation_count >= parameters_.min_observation_ratio * candidate.times_in_view;
}

Candidate* SmoothingMapper::matching_candidate(const Eigen::Vector2d& position,
                                               const model::KeyframeLandmark& seen) {
  const double sigma = std::sqrt(0.5 * seen.covariance_m2.trace());
  double best = parameters_.gate_sigmas * std::sqrt(2.0) * sigma + 0.1;
  Candidate* result = nullptr;
  for (Candidate& candidate : candidates_) {
    const double distance = (candidate.position_m - position).norm();
    if (candidate.kind != seen.kind || distance >= best) continue;
    best = distance;
    result = &candidate;
  }
  return result;
}

void SmoothingMapper::promote(const Candidate& candidate, model::MapUpdate& update) {
  StoredLandmark landmark;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Candidate::Observation& observation : candidate.observations) {
    const double weight = 2.0 / observation.landmark.covariance_m2.trace();
    sum += weight *
           (smoother_.pose(nodes_[observation.node].centre) * observation.landmark.position_m);
    landmark.information += weight;
    landmark.radius_m +=
        observation.landmark.radius_m / static_cast<double>(candidate.observations.size());
    landmark.nodes.push_back(observation.node);
  }
  landmark.position_m = sum / landmark.information;
  landmark.observation_count = candidate.observation_count;
  landmark.last_keyframe = keyframes_;
  landmark.kind = candidate.kind;
  std::sort(landmark.nodes.begin(), landmark.nodes.end());
  landmark.point = add_point(landmark);
  const model::LandmarkId id = store_.insert(landmark);
  landmark_of_point_.back() = id;
  for (const Candidate::Observation& observation : candidate.observations)
    observe(observation.node, observation.landmark, id);
  update.added.push_back(id);
  changed_.push_back(id);
}

void SmoothingMapper::forget_stale_candidates() {
  std::erase_if(candidates_, [&](const Candidate& candidate) {
    return candidate.first_keyframe + static_cast<std::uint32_t>(parameters_.candidate_keyframes) <
           keyframes_;
  });
}

/// Two landmarks near each other that places do not see side by side are one. The one seen less
/// often is taken over; its detections count on where they agree, within the noise, with the
/// other's place.
void SmoothingMapper::merge_doubles(model::MapUpdate& update) {
  std::vector<model::LandmarkId> touched = update.added;
  for (const model::Association& pair : update.associations) touched.push_back(pair.landmark_id);
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  for (const model::LandmarkId id : touched) {
    if (!store_.all().contains(id)) continue;
    const StoredLandmark& landmark = store_.at(id);
    for (const model::LandmarkId other_id :
         store_.index().near({landmark.position_m,
                              parameters_.merge_distance_m + 2.0 * LandmarkStore::kStaleness_m})) {
      if (other_id == id) continue;
      const StoredLandmark& other = store_.at(other_id);
      const double distance = (other.position_m - landmark.position_m).norm();
      if (distance > parameters_.merge_distance_m || !landmark.point || !other.point ||
          landmark.kind != other.kind || are_seen_together(landmark, other)) {
        continue;
      }
      const bool keep_first =
          std::pair(landmark.observation_count, other_id) > std::pair(other.observation_count, id);
      const model::LandmarkId keep = keep_first ? id : other_id;
      const model::LandmarkId drop = keep_first ? other_id : id;
      take_over(drop, keep);
      update.merged.emplace_back(drop, keep);
      break;
    }
  }
}

void SmoothingMapper::take_over(model::LandmarkId old_id, model::LandmarkId new_id) {
  StoredLandmark& old_one = store_.at(old_id);
  StoredLandmark& new_one = store_.at(new_id);
  const double sigma = std::sqrt(old_one.local_variance() + new_one.local_variance());
  const bool agree = (old_one.position_m - new_one.position_m).norm() <=
                     parameters_.gate_sigmas * sigma + parameters_.gate_floor_m;
  for (const NodeIndex node : old_one.nodes) {
    auto handle = nodes_[node].observations.extract(old_id);
    if (handle.empty()) continue;
    factor_graph::plane::PointObservation factor = smoother_.observation(handle.mapped());
    factor.point = *new_one.point;
    // A place that saw both keeps what it says of the one that stays.
    const bool has_both = nodes_[node].observations.contains(new_id);
    if (!agree || has_both) factor.information.setZero();
    smoother_.set(handle.mapped(), factor);
    handle.key() = new_id;
    nodes_[node].observations.insert(std::move(handle));
  }
  std::vector<NodeIndex> nodes;
  std::set_union(old_one.nodes.begin(), old_one.nodes.end(), new_one.nodes.begin(),
                 new_one.nodes.end(), std::back_inserter(nodes));
  new_one.nodes = std::move(nodes);
  landmark_of_point_[index(*old_one.point)] = 0;
  if (agree) new_one.information += old_one.information;
  new_one.observation_count += old_one.observation_count;
  new_one.last_keyframe = std::max(new_one.last_keyframe, old_one.last_keyframe);
  store_.remove(old_id);
}

}  // namespace understory::geoslam_mapper::smoothing
