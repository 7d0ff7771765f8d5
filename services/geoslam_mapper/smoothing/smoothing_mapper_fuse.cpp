// What does a keyframe add to the graph?
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>

#include "services/geoslam_mapper/smoothing/smoothing_mapper.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// chi^2 as a standard normal deviate (Wilson & Hilferty 1931).
double chi2_deviate(double chi2, double degrees_of_freedom) {
  const double spread = 2.0 / (9.0 * degrees_of_freedom);
  return (std::cbrt(chi2 / degrees_of_freedom) - (1.0 - spread)) / std::sqrt(spread);
}

/// Less than that of what lasts is left between two places.
constexpr double kAlike = 0.02;

}  // namespace

NodeIndex SmoothingMapper::add_node(const geometry::SE2& map_T_centre,
                                    const model::Keyframe& keyframe) {
  const geometry::SE2 way = keyframe.members.front().centre_T_vehicle.inverse() *
                            keyframe.members.back().centre_T_vehicle;
  const bool is_stationary = way.translation().norm() < parameters_.fold_distance_m &&
                             std::abs(way.theta()) < parameters_.fold_angle_rad;
  nodes_.push_back({smoother_.add_pose(map_T_centre), {}, is_stationary});
  return static_cast<NodeIndex>(nodes_.size() - 1);
}

/// A landmark of a given map enters the graph with its prior when it is first observed (thesis
/// §4.3.1).
void SmoothingMapper::put_into_graph(StoredLandmark& landmark) {
  if (landmark.point) return;
  landmark.point = add_point(landmark);
  smoother_.add(factor_graph::plane::PointPrior{*landmark.point, landmark.position_m,
                                                landmark.prior_covariance.inverse()});
}

factor_graph::plane::PointId SmoothingMapper::add_point(const StoredLandmark& landmark) {
  landmark_of_point_.push_back(landmark.id);
  return smoother_.add_point(landmark.position_m);
}

void SmoothingMapper::add_base(const Base& base) {
  bases_.push_back(base);
  standings_of_node_.resize(nodes_.size());
  std::vector<std::uint32_t>& standings = standings_of_node_[base.node];
  const double apart_m = 0.25 * parameters_.fold_distance_m;
  for (const std::uint32_t other : standings) {
    const geometry::SE2 between =
        bases_[standings_[other]].centre_T_middle.inverse() * base.centre_T_middle;
    if (between.translation().norm() < apart_m &&
        std::abs(between.theta()) < 0.25 * parameters_.fold_angle_rad) {
      return;
    }
  }
  standings.push_back(static_cast<std::uint32_t>(standings_.size()));
  standings_.push_back(static_cast<std::uint32_t>(bases_.size() - 1));
  places_.put(standings.back(), middle_pose(base).translation());
}

/// By how much more uncertain sightings are that repeat each other: a share of a sighting's
/// variance is the same as long as the place it is seen from is. It counts as white noise of the
/// same power.
double SmoothingMapper::repetition(NodeIndex node, const model::KeyframeLandmark& seen,
                                   model::LandmarkId id) const {
  const auto scans = static_cast<double>(seen.observation_count);
  if (nodes_[node].is_stationary && parameters_.stationary_share > 0.0)
    return std::max(1.0, scans * parameters_.stationary_share);
  if (parameters_.correlated_share == 0.0) return 1.0;
  const Eigen::Vector2d here = smoother_.pose(nodes_[node].centre).translation();
  double views = scans;
  const std::vector<NodeIndex>& before = store_.at(id).nodes;
  for (auto other = before.rbegin(); other != before.rend(); ++other) {
    const Eigen::Vector2d there = smoother_.pose(nodes_[*other].centre).translation();
    const double alike = std::exp(-(here - there).norm() / parameters_.correlation_m);
    if (alike < kAlike) break;
    views += scans * alike;
  }
  return 1.0 + 2.0 * parameters_.correlated_share * (views - 1.0);
}

/// A second sighting from the same node is averaged into the first by information.
void SmoothingMapper::observe(NodeIndex node, const model::KeyframeLandmark& seen,
                              model::LandmarkId id) {
  const Eigen::Matrix2d information = seen.covariance_m2.inverse() / repetition(node, seen, id);
  const auto [entry, fresh] = nodes_[node].observations.try_emplace(id);
  if (fresh) {
    entry->second = smoother_.add(factor_graph::plane::PointObservation{
        nodes_[node].centre, *store_.at(id).point, seen.position_m, information});
    return;
  }
  // Who stands sees nothing new.
  if (nodes_[node].is_stationary && parameters_.stationary_share > 0.0) return;
  factor_graph::plane::PointObservation factor = smoother_.observation(entry->second);
  const Eigen::Matrix2d sum = factor.information + information;
  factor.position =
      sum.inverse() * (factor.information * factor.position + information * seen.position_m);
  factor.information = sum;
  smoother_.set(entry->second, factor);
}

/// The node of the nearest earlier keyframe, when this one stands where that stood: nothing new is
/// seen from there.
std::optional<NodeIndex> SmoothingMapper::foldable(const model::Keyframe& keyframe,
                                                   const Placement& placement) const {
  const geometry::SE2 map_T_middle = placement.map_T_centre.mean * middle_of(keyframe);
  std::optional<NodeIndex> best;
  double best_distance = parameters_.fold_distance_m;
  places_.for_each_near(map_T_middle.translation(), best_distance, [&](std::uint32_t standing) {
    const Base& base = bases_[standings_[standing]];
    const geometry::SE2 between = middle_pose(base).inverse() * map_T_middle;
    const double distance = between.translation().norm();
    const bool is_nearer =
        distance < best_distance || (distance == best_distance && best < base.node);
    if (!is_nearer || std::abs(between.theta()) > parameters_.fold_angle_rad) return;
    best = base.node;
    best_distance = distance;
  });
  return best;
}

/// The keyframe as the node's centre would have seen it: what both saw ties the two frames
/// together.
model::Keyframe SmoothingMapper::in_frame_of(NodeIndex node, const model::Keyframe& keyframe,
                                             const Placement& placement) const {
  const geometry::SE2 node_T_keyframe =
      smoother_.pose(nodes_[node].centre).inverse() * placement.map_T_centre.mean;
  const Eigen::Matrix2d rotation = node_T_keyframe.rotation();
  model::Keyframe result = keyframe;
  for (model::KeyframeLandmark& seen : result.landmarks) {
    seen.position_m = node_T_keyframe * seen.position_m;
    seen.covariance_m2 = rotation * seen.covariance_m2 * rotation.transpose();
  }
  for (model::KeyframeMember& member : result.members)
    member.centre_T_vehicle = node_T_keyframe * member.centre_T_vehicle;
  return result;
}

/// Adds the keyframe to the graph and solves it; where the result is inconsistent, everything is
/// taken back and false returned.
bool SmoothingMapper::fuse(const model::Keyframe& arrived, const Placement& placement,
                           model::MapUpdate& update) {
  smoother_.checkpoint();
  const std::vector<Node>::size_type nodes_before = nodes_.size();
  const std::optional<NodeIndex> fold = foldable(arrived, placement);
  const model::Keyframe keyframe = fold ? in_frame_of(*fold, arrived, placement) : arrived;
  const NodeIndex node = fold ? *fold : add_node(placement.map_T_centre.mean, keyframe);
  const Node node_before = nodes_[node];
  const GyroBias gyro_before = gyro_;
  std::vector<model::LandmarkId> entered;
  for (const model::Association& pair : placement.associations) {
    StoredLandmark& landmark = store_.at(pair.landmark_id);
    if (!landmark.point) entered.push_back(landmark.id);
    put_into_graph(landmark);
    observe(node, keyframe.landmarks[pair.keyframe_landmark], pair.landmark_id);
  }
  add_motion(keyframe, node);
  update.associations = placement.associations;
  if (!solve(node, update)) {
    smoother_.rollback();
    gyro_ = gyro_before;
    for (const model::LandmarkId id : entered) store_.at(id).point.reset();
    landmark_of_point_.resize(landmark_of_point_.size() - entered.size());
    if (nodes_.size() > nodes_before) {
      nodes_.pop_back();
    } else {
      nodes_[node] = node_before;
    }
    update.associations.clear();
    return false;
  }
  ++keyframes_;
  add_base({node,
            keyframe.sequence,
            keyframe.utime,
            {keyframe.centre_T_base(), keyframe.members.front().covariance},
            middle_of(keyframe),
            false});
  count_observations(keyframe, node, update);
  adopt_estimates();
  discover(keyframe, node, update);
  merge_doubles(update);
  finish(arrived, update);
  return true;
}

/// Solves, takes out single associations that do not fit, and judges what is left.
bool SmoothingMapper::solve(NodeIndex node, model::MapUpdate& update) {
  factor_graph::plane::SmootherUpdate solved = smoother_.update();
  if (!solved.ok) {
    update.reason = solved.error;
    return false;
  }
  std::set<model::LandmarkId> outliers;
  update.chi2 = 0.0;
  update.degrees_of_freedom = 0;
  for (const model::Association& pair : update.associations) {
    const double error = smoother_.chi2(nodes_[node].observations.at(pair.landmark_id));
    if (error > parameters_.outlier_chi2) {
      outliers.insert(pair.landmark_id);
    } else {
      update.chi2 += error;
      update.degrees_of_freedom += 2;
    }
  }
  if (update.degrees_of_freedom > 0 &&
      chi2_deviate(update.chi2, update.degrees_of_freedom) > parameters_.max_innovation_sigmas) {
    update.reason = "innovation too large for its covariance";
    return false;
  }
  if (2 * outliers.size() > update.associations.size()) {
    update.reason = "most associations do not fit";
    return false;
  }
  if (outliers.empty()) return true;
  for (const model::LandmarkId id : outliers) {
    const factor_graph::plane::ObservationId factor = nodes_[node].observations.at(id);
    factor_graph::plane::PointObservation nothing = smoother_.observation(factor);
    nothing.information.setZero();
    smoother_.set(factor, nothing);
    nodes_[node].observations.erase(id);
  }
  std::erase_if(update.associations, [&](const model::Association& pair) {
    return outliers.contains(pair.landmark_id);
  });
  solved = smoother_.update();
  update.reason = solved.error;
  return solved.ok;
}

void SmoothingMapper::count_observations(const model::Keyframe& keyframe, NodeIndex node,
                                         const model::MapUpdate& update) {
  for (const model::Association& pair : update.associations) {
    const model::KeyframeLandmark& seen = keyframe.landmarks[pair.keyframe_landmark];
    StoredLandmark& landmark = store_.at(pair.landmark_id);
    landmark.observation_count += seen.observation_count;
    landmark.last_keyframe = keyframes_;
    landmark.information += 2.0 / seen.covariance_m2.trace();
    landmark.radius_m +=
        (seen.radius_m - landmark.radius_m) / static_cast<double>(landmark.nodes.size() + 1);
    if (landmark.nodes.empty() || landmark.nodes.back() != node) landmark.nodes.push_back(node);
  }
}

/// What the last keyframe's updates moved; the rest is where it was.
void SmoothingMapper::adopt_estimates() {
  for (const factor_graph::plane::PointId point : smoother_.moved_points()) {
    const model::LandmarkId id = landmark_of_point_[index(point)];
    if (id == 0) continue;
    store_.move(id, smoother_.point(point));
    changed_.push_back(id);
  }
  for (const factor_graph::plane::PoseId pose : smoother_.moved_poses()) {
    // A node's number is that of its pose.
    const NodeIndex node = index(pose);
    if (node >= standings_of_node_.size()) continue;
    for (const std::uint32_t standing : standings_of_node_[node]) {
      places_.put(standing, middle_pose(bases_[standings_[standing]]).translation());
    }
  }
}

}  // namespace understory::geoslam_mapper::smoothing
