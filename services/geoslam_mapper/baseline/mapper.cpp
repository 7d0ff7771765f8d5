#include "services/geoslam_mapper/baseline/mapper.hpp"

#include <algorithm>
#include <random>
#include <span>
#include <utility>

#include "common/hierarchy/baseline/matching.hpp"
#include "services/geoslam_mapper/baseline/mapper_state.hpp"
#include "services/geoslam_mapper/baseline/pose.hpp"

namespace understory::geoslam_mapper::baseline {
namespace {

/// Map 1, counter 1.
constexpr model::LandmarkId kFirstId = (model::LandmarkId{1} << 48) | 1;
/// The published code seeds every keyframe's samples alike.
constexpr std::uint32_t kSampleSeed = 10;

std::vector<Eigen::Vector2d> positions_of(const model::Keyframe& keyframe) {
  std::vector<Eigen::Vector2d> positions;
  positions.reserve(keyframe.landmarks.size());
  for (const model::KeyframeLandmark& landmark : keyframe.landmarks) {
    positions.push_back(landmark.position_m);
  }
  return positions;
}

geometry::SE2 to_pose(const Eigen::Vector3d& pose) { return {pose.x(), pose.y(), pose.z()}; }

/// The thesis's method; see MapperMethod for the functions.
class BaselineMapper final : public MapperMethod {
 public:
  explicit BaselineMapper(const BaselineMapperParameters& parameters)
      : parameters_(parameters),
        discovery_{parameters.discovery_observations, parameters.discovery_window,
                   parameters.discovery_association_m} {}

  model::MapUpdate add(const model::Keyframe& keyframe) override;
  void add(const model::Odometry& /*odometry*/) override {}  // The thesis uses none.
  void start_with(std::span<const model::MapLandmark> landmarks) override;
  std::vector<model::KeyframePose> trajectory() const override;
  std::vector<model::MapLandmark> landmarks() const override;
  std::string save() const override { return baseline::save(state_); }
  void load(const std::string& state) override {
    state_ = load_mapper_state(state, parameters_.descriptor_step);
  }

 private:
  std::vector<hierarchy::baseline::PointMatch> match(std::span<const Eigen::Vector2d> local) const;
  void start_map(const model::Keyframe& keyframe, model::MapUpdate& update);
  bool localise_and_fuse(const model::Keyframe& keyframe, model::MapUpdate& update);
  bool extend(const model::Keyframe& keyframe, const PoseEstimate& estimate,
              model::MapUpdate& update);
  bool fuse(const model::Keyframe& keyframe, const PoseEstimate& estimate,
            model::MapUpdate& update);
  void add_pose(const model::Keyframe& keyframe, const Eigen::Vector3d& pose);
  void add_landmark(const Eigen::Vector2d& position_m, LandmarkRecord record,
                    model::MapUpdate& update);
  void rebuild_hierarchy();

  BaselineMapperParameters parameters_;
  DiscoveryParameters discovery_;
  MapperState state_;
};

void BaselineMapper::start_with(std::span<const model::MapLandmark> landmarks) {
  state_ = MapperState{};
  for (const model::MapLandmark& landmark : landmarks) {
    state_.map.graph.landmarks_m.push_back(landmark.position_m);
    state_.map.landmarks.push_back({landmark.id, landmark.radius_m, 0, landmark.kind});
    state_.map.last_id = std::max(state_.map.last_id, landmark.id);
  }
  rebuild_hierarchy();
}

model::MapUpdate BaselineMapper::add(const model::Keyframe& keyframe) {
  model::MapUpdate update;
  update.keyframe_sequence = keyframe.sequence;
  update.utime = keyframe.utime;
  if (keyframe.landmarks.size() < 3 || keyframe.members.empty()) {
    update.reason = "fewer than three landmarks";
    return update;
  }

  if (state_.map.landmarks.empty()) {
    start_map(keyframe, update);
  } else if (!localise_and_fuse(keyframe, update)) {
    return update;
  }

  update.map_T_vehicle = to_pose(state_.map.graph.poses.back());
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
bool BaselineMapper::localise_and_fuse(const model::Keyframe& keyframe, model::MapUpdate& update) {
  update.status = model::MapUpdateStatus::kNotSure;

  // Which polygons match?
  const std::vector<Eigen::Vector2d> local = positions_of(keyframe);
  const std::vector<hierarchy::baseline::PointMatch> matches = match(local);
  if (matches.size() < static_cast<std::size_t>(parameters_.min_associations)) {
    update.reason = "too few associations of polygons";
    return false;
  }

  // Which pose do they give?
  std::mt19937 random(kSampleSeed);
  const auto estimate =
      estimate_pose(local, state_.map.graph.landmarks_m, matches, parameters_, random);
  if (!estimate) {
    update.reason = "no pose with enough associations";
    return false;
  }

  return fuse(keyframe, *estimate, update);
}

/// Algorithm 3, lines 5-7: a larger and larger tau until there are associations enough.
std::vector<hierarchy::baseline::PointMatch> BaselineMapper::match(
    std::span<const Eigen::Vector2d> local) const {
  const hierarchy::baseline::Hierarchy hierarchy(local, parameters_.descriptor_step);
  const hierarchy::baseline::HierarchyMatches matches(
      hierarchy, state_.hierarchy,
      {parameters_.max_descriptor_distance, parameters_.max_side_difference,
       parameters_.min_triangle_match_ratio});

  double tau = parameters_.initial_descriptor_distance;
  while (true) {
    std::vector<hierarchy::baseline::PointMatch> pairs = matches.points(tau);
    tau += parameters_.descriptor_distance_step;
    // Enough is gamma itself, as in the code; the thesis' loop asks for more than gamma.
    if (pairs.size() >= static_cast<std::size_t>(parameters_.min_associations) ||
        tau > parameters_.max_descriptor_distance) {
      return pairs;
    }
  }
}

void BaselineMapper::start_map(const model::Keyframe& keyframe, model::MapUpdate& update) {
  update.status = model::MapUpdateStatus::kFirstMap;
  add_pose(keyframe, Eigen::Vector3d::Zero());
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const model::KeyframeLandmark& landmark = keyframe.landmarks[i];
    add_landmark(landmark.position_m,
                 {0, landmark.radius_m, landmark.observation_count, landmark.kind}, update);
    state_.map.graph.landmark_edges.push_back({0, i, landmark.position_m});
    update.associations.push_back({i, state_.map.landmarks.back().id});
  }
  rebuild_hierarchy();
}

void BaselineMapper::add_pose(const model::Keyframe& keyframe, const Eigen::Vector3d& pose) {
  Graph& graph = state_.map.graph;
  if (!graph.poses.empty()) {
    const auto newest = static_cast<std::uint32_t>(graph.poses.size());
    graph.pose_edges.push_back({newest - 1, newest, pose - graph.poses.back()});
  }
  graph.poses.push_back(pose);
  state_.map.poses.push_back({keyframe.sequence, keyframe.utime});
}

void BaselineMapper::add_landmark(const Eigen::Vector2d& position_m, LandmarkRecord record,
                                  model::MapUpdate& update) {
  record.id = state_.map.last_id == 0 ? kFirstId : state_.map.last_id + 1;
  state_.map.last_id = record.id;
  state_.map.graph.landmarks_m.push_back(position_m);
  state_.map.landmarks.push_back(record);
  update.added.push_back(record.id);
}

void BaselineMapper::rebuild_hierarchy() {
  state_.hierarchy =
      hierarchy::baseline::Hierarchy(state_.map.graph.landmarks_m, parameters_.descriptor_step);
  state_.hierarchy_points_m = state_.map.graph.landmarks_m;
}

/// Adds the pose, its associations and the landmarks that it confirms; whether there are any such.
bool BaselineMapper::extend(const model::Keyframe& keyframe, const PoseEstimate& estimate,
                            model::MapUpdate& update) {
  MapContents& map = state_.map;
  const auto pose = static_cast<std::uint32_t>(map.graph.poses.size());
  add_pose(keyframe, estimate.map_T_base.pose().coordinates());
  for (const hierarchy::baseline::PointMatch& pair : estimate.associations) {
    const model::KeyframeLandmark& landmark = keyframe.landmarks[pair.local];
    map.graph.landmark_edges.push_back({pose, pair.other, landmark.position_m});
    map.landmarks[pair.other].observation_count += landmark.observation_count;
    update.associations.push_back({pair.local, map.landmarks[pair.other].id});
  }

  std::vector<Observation> observations;
  for (const PlacedLandmark& placed : estimate.unmatched) {
    const model::KeyframeLandmark& landmark = keyframe.landmarks[placed.local];
    observations.push_back({placed.position_m, landmark.position_m, landmark.radius_m,
                            landmark.kind, landmark.observation_count});
  }

  const std::vector<Discovery> discoveries = map.network.add(pose, observations, discovery_);
  for (const Discovery& discovery : discoveries) {
    const auto number = static_cast<std::uint32_t>(map.graph.landmarks_m.size());
    LandmarkRecord record;
    for (const auto& [observer, observation] : discovery.observations) {
      map.graph.landmark_edges.push_back({observer, number, observation.in_pose_m});
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
bool BaselineMapper::fuse(const model::Keyframe& keyframe, const PoseEstimate& estimate,
                          model::MapUpdate& update) {
  MapContents before = state_.map;
  const std::size_t first_edge = state_.map.graph.landmark_edges.size();
  const bool has_new = extend(keyframe, estimate, update);

  const auto step = gauss_newton_step(state_.map.graph);
  update.candidates = estimate.attempts;
  update.inliers = static_cast<std::uint32_t>(estimate.associations.size());
  update.degrees_of_freedom = 2 * update.inliers;
  update.chi2 = step ? newest_pose_error(state_.map.graph, *step, first_edge) : 0.0;

  if (!step || update.chi2 > parameters_.max_newest_pose_error) {
    state_.map = std::move(before);
    update.status = model::MapUpdateStatus::kRolledBack;
    update.reason = step ? "error of the newest pose" : "normal matrix not positive definite";
    update.associations.clear();
    update.added.clear();
    return false;
  }

  apply(*step, state_.map.graph);
  if (has_new) {
    rebuild_hierarchy();
  } else {
    state_.hierarchy.move_points(state_.map.graph.landmarks_m);
  }
  state_.map.network.slide(discovery_);
  update.status = model::MapUpdateStatus::kUpdated;
  return true;
}

std::vector<model::KeyframePose> BaselineMapper::trajectory() const {
  std::vector<model::KeyframePose> poses;
  for (std::size_t i = 0; i < state_.map.poses.size(); ++i) {
    poses.push_back({state_.map.poses[i].keyframe_sequence, state_.map.poses[i].utime,
                     to_pose(state_.map.graph.poses[i]), Eigen::Matrix3d::Zero()});
  }
  return poses;
}

std::vector<model::MapLandmark> BaselineMapper::landmarks() const {
  std::vector<model::MapLandmark> landmarks;
  for (std::size_t i = 0; i < state_.map.landmarks.size(); ++i) {
    const LandmarkRecord& record = state_.map.landmarks[i];
    landmarks.push_back({record.id, state_.map.graph.landmarks_m[i], Eigen::Matrix2d::Zero(),
                         record.radius_m, record.observation_count, record.kind});
  }
  std::stable_sort(
      landmarks.begin(), landmarks.end(),
      [](const model::MapLandmark& a, const model::MapLandmark& b) { return a.id < b.id; });
  return landmarks;
}

}  // namespace

std::unique_ptr<MapperMethod> make_baseline_mapper(const BaselineMapperParameters& parameters) {
  return std::make_unique<BaselineMapper>(parameters);
}

}  // namespace understory::geoslam_mapper::baseline
