#include "services/geoslam_mapper/smoothing/expansion.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

#include "common/factor_graph/plane/optimise.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// Information of the pose that holds the map: a micrometre.
constexpr double kHeldInformation = 1e12;
/// Driving time [s] per bias of the gyro; as in GyroBias.
constexpr double kBias_s = 5.0;
/// The iteration ends when a step lowers chi^2 by less than this share.
constexpr double kLastDecrease = 1e-11;

/// Builds the graph of a drive, stretch by stretch.
class Expansion {
 public:
  Expansion(const LandmarkAliases& aliases, const SmoothingMapperParameters& parameters)
      : aliases_(aliases), parameters_(parameters) {}

  void add(const PlacedStretch& placed, std::size_t number) {
    const Stretch& stretch = *placed.stretch;
    for (const Stretch::Pose& pose : stretch.poses) add(pose, placed.map_T_origin, number);
    std::vector<plane::PointId> points;
    points.reserve(stretch.landmarks.size());
    for (const Stretch::Landmark& landmark : stretch.landmarks)
      points.push_back(point_of(landmark, placed.map_T_origin));

    for (const Stretch::Observation& one : stretch.observations) {
      const auto& [xx, xy, yy] = one.information;
      Eigen::Matrix2d information;
      information << xx, xy, xy, yy;
      result_.graph.observations.push_back({poses_.at(stretch.poses[one.pose].number),
                                            points[one.landmark],
                                            {one.position_m[0], one.position_m[1]},
                                            information});
    }
    motions_.insert(motions_.end(), stretch.motions.begin(), stretch.motions.end());
  }

  ExpandedDrive take() {
    // In order of time, whatever their stretch.
    std::sort(motions_.begin(), motions_.end(),
              [](const auto& a, const auto& b) { return std::max(a.a, a.b) < std::max(b.a, b.b); });
    for (const Stretch::Motion& motion : motions_) add(motion);
    std::sort(result_.keyframes.begin(), result_.keyframes.end(),
              [](const auto& a, const auto& b) { return a.utime < b.utime; });
    return std::move(result_);
  }

 private:
  void add(const Stretch::Pose& pose, const geometry::SE2& map_T_origin, std::size_t stretch) {
    const geometry::SE2 map_T_node = map_T_origin * pose.origin_T_node;
    const plane::PoseId id = result_.graph.add_pose(map_T_node);
    poses_[pose.number] = id;
    result_.stretch_of_pose.push_back(stretch);
    result_.scans_of_pose.push_back(pose.scans);
    if (pose.number == StretchNumber(0)) {
      result_.graph.pose_priors.push_back(
          {id, map_T_node, kHeldInformation * Eigen::Matrix3d::Identity()});
    }
    for (const Stretch::Keyframe& keyframe : pose.keyframes) {
      result_.keyframes.push_back({keyframe.sequence, keyframe.utime, id, keyframe.node_T_base});
    }
  }

  plane::PointId point_of(const Stretch::Landmark& landmark, const geometry::SE2& map_T_origin) {
    const auto [entry, is_new] = points_.try_emplace(aliases_(landmark.id));
    if (is_new) {
      entry->second =
          result_.graph.add_point(map_T_origin * landmark.origin_p_landmark.cast<double>());
    }
    return entry->second;
  }

  void add(const Stretch::Motion& motion) {
    const auto a = poses_.find(motion.a);
    const auto b = poses_.find(motion.b);
    if (a == poses_.end() || b == poses_.end()) return;
    const plane::RelativePose measured{a->second, b->second, motion.a_T_b, motion.information};
    if (motion.seconds == 0.0 || parameters_.gyro_walk <= 0.0) {
      result_.graph.relative_poses.push_back(measured);
      return;
    }
    result_.graph.biased_relative_poses.push_back({measured, bias_of(motion), motion.seconds});
    seconds_ += motion.seconds;
  }

  /// One per kBias_s of motion, with a random walk between them.
  plane::ScalarId bias_of(const Stretch::Motion& motion) {
    if (bias_ && seconds_ < kBias_s) return *bias_;
    plane::Graph& graph = result_.graph;
    graph.scalars.push_back(motion.bias_rad_s);
    const auto id = plane::ScalarId(static_cast<std::uint32_t>(graph.scalars.size() - 1));
    if (bias_) {
      const double variance = parameters_.gyro_walk * parameters_.gyro_walk * seconds_;
      graph.scalar_steps.push_back({*bias_, id, 1.0 / variance});
    } else {
      const double sigma = parameters_.gyro_start_sigma;
      graph.scalar_priors.push_back({id, 0.0, 1.0 / (sigma * sigma)});
    }
    bias_ = id;
    seconds_ = 0.0;
    return id;
  }

  const LandmarkAliases& aliases_;
  const SmoothingMapperParameters& parameters_;
  ExpandedDrive result_;
  std::map<StretchNumber, plane::PoseId> poses_;
  std::map<model::LandmarkId, plane::PointId> points_;
  std::vector<Stretch::Motion> motions_;
  std::optional<plane::ScalarId> bias_;
  double seconds_ = 0.0;  ///< Of the motions with the present bias.
};

}  // namespace

void LandmarkAliases::add(std::span<const std::pair<model::LandmarkId, model::LandmarkId>> merged) {
  for (const auto& [old_id, new_id] : merged) {
    newer_[old_id] = new_id;
    newer_.erase(
        new_id);  // A landmark of the map: a merge of it was undone. So the chain has no circle.
  }
}

model::LandmarkId LandmarkAliases::operator()(model::LandmarkId id) const {
  for (auto found = newer_.find(id); found != newer_.end(); found = newer_.find(id))
    id = found->second;
  return id;
}

std::vector<model::KeyframePose> ExpandedDrive::trajectory() const {
  std::vector<model::KeyframePose> poses;
  poses.reserve(keyframes.size());
  for (const Keyframe& one : keyframes)
    poses.push_back({one.sequence, one.utime, graph[one.pose] * one.pose_T_base, {}});
  return poses;
}

ExpandedDrive expand(std::span<const PlacedStretch> stretches, const LandmarkAliases& aliases,
                     const SmoothingMapperParameters& parameters) {
  Expansion expansion(aliases, parameters);
  for (std::size_t i = 0; i < stretches.size(); ++i) expansion.add(stretches[i], i);
  return expansion.take();
}

bool settle(ExpandedDrive& drive, const SmoothingMapperParameters& parameters) {
  factor_graph::batch::BatchParameters batch;
  batch.relative_decrease = kLastDecrease;
  plane::Graph solved = drive.graph;
  if (!plane::optimise(solved, batch).ok) return false;

  const auto is_outlier = [&](const plane::PointObservation& one) {
    return chi2(solved, one) > parameters.outlier_chi2;
  };
  if (std::any_of(solved.observations.begin(), solved.observations.end(), is_outlier)) {
    plane::Graph without = solved;
    std::erase_if(without.observations, is_outlier);
    if (plane::optimise(without, batch).ok) solved = std::move(without);
  }
  drive.graph = std::move(solved);
  return true;
}

}  // namespace understory::geoslam_mapper::smoothing
