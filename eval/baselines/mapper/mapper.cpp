#include "eval/baselines/mapper/mapper.hpp"

#include <algorithm>
#include <utility>

namespace understory::eval::baselines::mapper {
namespace {

/// Map 1, counter 1.
constexpr model::LandmarkId kFirstId = (model::LandmarkId{1} << 48) | 1;

std::vector<Eigen::Vector2d> positions_of(const model::Keyframe& keyframe) {
  std::vector<Eigen::Vector2d> positions;
  positions.reserve(keyframe.landmarks.size());
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
    positions.push_back(landmark.position_m);
  }
  return positions;
}

geometry::SE2 to_pose(const Eigen::Vector3d& pose) { return {pose.x(), pose.y(), pose.z()}; }

DiscoveryParameters discovery_parameters(const Parameters& parameters) {
  return {parameters.discovery_observations, parameters.discovery_window,
          parameters.discovery_association_m};
}

}  // namespace

Mapper::Mapper(const Parameters& parameters) : parameters_(parameters) {}

void Mapper::start_with(std::span<const model::MapLandmark> landmarks) {
  map_ = MapContents{};
  for (const model::MapLandmark& landmark : landmarks) {
    map_.graph.landmarks_m.push_back(landmark.position_m);
    map_.landmarks.push_back({landmark.id, landmark.radius_m, 0, landmark.kind});
    map_.last_id = std::max(map_.last_id, landmark.id);
  }
  rebuild_hierarchy();
}

model::MapUpdate Mapper::add(const model::Keyframe& keyframe) {
  model::MapUpdate update;
  update.keyframe_sequence = keyframe.sequence;
  update.utime = keyframe.utime;
  if (keyframe.landmarks.size() < 3 || keyframe.members.empty()) {
    update.reason = "fewer than three landmarks";
    return update;
  }

  if (map_.landmarks.empty()) {
    start_map(keyframe, update);
  } else if (!localise_and_fuse(keyframe, update)) {
    return update;
  }

  update.map_T_vehicle = to_pose(map_.graph.poses.back());
  const auto latest =
      std::max_element(keyframe.members.begin(), keyframe.members.end(),
                       [](const model::KeyframeMember& a, const model::KeyframeMember& b) {
                         return a.utime < b.utime;
                       });
  update.map_T_latest_vehicle =
      update.map_T_vehicle * keyframe.centre_T_base().inverse() * latest->centre_T_vehicle;
  return update;
}

/// Algorithm 3. Whether the keyframe is in the map now; otherwise `update` states why not.
bool Mapper::localise_and_fuse(const model::Keyframe& keyframe, model::MapUpdate& update) {
  update.status = model::MapUpdateStatus::kNotSure;

  const Localisation found =
      localise(positions_of(keyframe), map_.graph.landmarks_m, hierarchy_, parameters_);
  if (!found.estimate) {
    update.reason = found.reason;
    return false;
  }
  return fuse(keyframe, *found.estimate, update);
}

void Mapper::start_map(const model::Keyframe& keyframe, model::MapUpdate& update) {
  update.status = model::MapUpdateStatus::kFirstMap;
  add_pose(keyframe, Eigen::Vector3d::Zero());
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const model::KeyframeLandmark& landmark = keyframe.landmarks[i];
    add_landmark(landmark.position_m,
                 {0, landmark.radius_m, landmark.observation_count, landmark.kind}, update);
    map_.graph.landmark_edges.push_back({0, i, landmark.position_m});
    update.associations.push_back({i, map_.landmarks.back().id});
  }
  rebuild_hierarchy();
}

void Mapper::add_pose(const model::Keyframe& keyframe, const Eigen::Vector3d& pose) {
  Graph& graph = map_.graph;
  if (!graph.poses.empty()) {
    const auto newest = static_cast<std::uint32_t>(graph.poses.size());
    graph.pose_edges.push_back({newest - 1, newest, pose - graph.poses.back()});
  }
  graph.poses.push_back(pose);
  map_.poses.push_back({keyframe.sequence, keyframe.utime});
}

void Mapper::add_landmark(const Eigen::Vector2d& position_m, LandmarkRecord record,
                          model::MapUpdate& update) {
  record.id = map_.last_id == 0 ? kFirstId : map_.last_id + 1;
  map_.last_id = record.id;
  map_.graph.landmarks_m.push_back(position_m);
  map_.landmarks.push_back(record);
  update.added.push_back(record.id);
}

void Mapper::rebuild_hierarchy() {
  hierarchy_ = hierarchy::Hierarchy(map_.graph.landmarks_m, parameters_.descriptor_step);
}

/// Adds the pose, its associations and the landmarks that it confirms; whether there are any such.
bool Mapper::extend(const model::Keyframe& keyframe, const PoseEstimate& estimate,
                    model::MapUpdate& update) {
  const auto pose = static_cast<std::uint32_t>(map_.graph.poses.size());
  add_pose(keyframe, estimate.map_T_base.pose().coordinates());
  for (const hierarchy::PointMatch& pair : estimate.associations) {
    const model::KeyframeLandmark& landmark = keyframe.landmarks[pair.local];
    map_.graph.landmark_edges.push_back({pose, pair.other, landmark.position_m});
    map_.landmarks[pair.other].observation_count += landmark.observation_count;
    update.associations.push_back({pair.local, map_.landmarks[pair.other].id});
  }

  std::vector<Observation> observations;
  for (const PlacedLandmark& placed : estimate.unmatched) {
    const model::KeyframeLandmark& landmark = keyframe.landmarks[placed.local];
    observations.push_back({placed.position_m, landmark.position_m, landmark.radius_m,
                            landmark.kind, landmark.observation_count});
  }

  const std::vector<Discovery> discoveries =
      map_.network.add(pose, observations, discovery_parameters(parameters_));
  for (const Discovery& discovery : discoveries) {
    const auto number = static_cast<std::uint32_t>(map_.graph.landmarks_m.size());
    LandmarkRecord record;
    for (const auto& [observer, observation] : discovery.observations) {
      map_.graph.landmark_edges.push_back({observer, number, observation.in_pose_m});
      record.radius_m += observation.radius_m / static_cast<double>(discovery.observations.size());
      record.observation_count += observation.observation_count;
      record.kind = observation.kind;
    }
    add_landmark(discovery.position_m, record, update);
  }
  return !discoveries.empty();
}

/// Extends the map and takes one step. All of it is rolled back if the newest pose then disagrees
/// too much with its observations.
bool Mapper::fuse(const model::Keyframe& keyframe, const PoseEstimate& estimate,
                  model::MapUpdate& update) {
  MapContents before = map_;
  const std::size_t first_edge = map_.graph.landmark_edges.size();
  const bool has_new = extend(keyframe, estimate, update);

  const auto step = gauss_newton_step(map_.graph);
  update.candidates = estimate.attempts;
  update.inliers = static_cast<std::uint32_t>(estimate.associations.size());
  update.degrees_of_freedom = 2 * update.inliers;
  update.chi2 = step ? newest_pose_error(map_.graph, *step, first_edge) : 0.0;

  if (!step || update.chi2 > parameters_.max_newest_pose_error) {
    map_ = std::move(before);
    update.status = model::MapUpdateStatus::kRolledBack;
    update.reason = step ? "error of the newest pose" : "normal matrix not positive definite";
    update.associations.clear();
    update.added.clear();
    return false;
  }

  apply(*step, map_.graph);
  if (has_new) {
    rebuild_hierarchy();
  } else {
    hierarchy_.move_points(map_.graph.landmarks_m);
  }
  map_.network.slide(discovery_parameters(parameters_));
  update.status = model::MapUpdateStatus::kUpdated;
  return true;
}

std::vector<model::KeyframePose> Mapper::trajectory() const {
  std::vector<model::KeyframePose> poses;
  for (std::size_t i = 0; i < map_.poses.size(); ++i) {
    poses.push_back({map_.poses[i].keyframe_sequence, map_.poses[i].utime,
                     to_pose(map_.graph.poses[i]), Eigen::Matrix3d::Zero()});
  }
  return poses;
}

std::vector<model::MapLandmark> Mapper::landmarks() const {
  std::vector<model::MapLandmark> landmarks;
  for (std::size_t i = 0; i < map_.landmarks.size(); ++i) {
    const LandmarkRecord& record = map_.landmarks[i];
    landmarks.push_back({record.id, map_.graph.landmarks_m[i], Eigen::Matrix2d::Zero(),
                         record.radius_m, record.observation_count, record.kind});
  }
  std::stable_sort(
      landmarks.begin(), landmarks.end(),
      [](const model::MapLandmark& a, const model::MapLandmark& b) { return a.id < b.id; });
  return landmarks;
}

}  // namespace understory::eval::baselines::mapper
