#include "common/map_closure/part_graph.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <set>
#include <tuple>

#include "common/geometry/decompositions.hpp"

namespace understory::map_closure {
namespace {

namespace plane = factor_graph::plane;

/// Holds the first part to a micrometre.
constexpr double kHeld = 1e12;
/// Holds a node of the ground to its piece, to 1 cm and 1 mrad (informations): a stiffer connection
/// slows down the optimiser.
constexpr double kFast_m = 1e4;
constexpr double kFast_rad = 1e6;
/// Sigma of a closure stored without covariance.
constexpr double kClosureSigma_m = 0.1;
constexpr double kClosureSigma_rad = 0.5 * std::numbers::pi / 180.0;
/// Least distance assumed between parts [m].
constexpr double kLeastStep_m = 1.0;
/// An information with less than this in any direction determines no motion.
constexpr double kUndetermined = 1e-6;

/// The mapper reuses numbers of nodes. A measurement with a larger difference belongs to another
/// node [m], [rad].
constexpr double kAnother_m = 5.0;
constexpr double kAnother_rad = 0.3;
/// Largest distance of a node from the first keyframe of its piece of the ground [m].
constexpr double kInPiece_m = 25.0;

/// This many common landmarks connect two parts.
constexpr int kHoldingPair = 2;

/// Groups of connected parts.
class Groups {
 public:
  explicit Groups(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  /// Adds a part in a group of its own; returns its index.
  std::size_t add() {
    parent_.push_back(parent_.size());
    return parent_.size() - 1;
  }
  /// True where the two were not in one group.
  bool join(std::size_t a, std::size_t b) {
    a = root(a);
    b = root(b);
    parent_[a] = b;
    return a != b;
  }

 private:
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  std::vector<std::size_t> parent_;
};

/// Puts measurements of parts into the graph. Variables are the parts, followed by nodes of the
/// ground.
class Builder {
 public:
  Builder(std::vector<Part> parts, const Ties& ties) : groups_(parts.size()) {
    out_.parts = std::move(parts);
    std::map<model::SubmapId, std::size_t> part_of;
    for (std::size_t i = 0; i < out_.parts.size(); ++i) {
      out_.graph.add_pose(out_.parts[i].map_T_part);
      if (out_.parts[i].submap != 0) part_of[out_.parts[i].submap] = i;
    }
    out_.graph.pose_priors.push_back(
        {pose_id(0), out_.graph.poses.front(), kHeld * Eigen::Matrix3d::Identity()});

    for (const auto& [node, submap] : ties.submap_of)
      if (part_of.contains(submap)) variable_of_[node] = part_of.at(submap);
    for (const Motion& one : ties.motions) add_ground_node(one);
  }

  void add(const Motion& motion) {
    const auto from = find(motion.from);
    const auto to = find(motion.to);
    if (!from || !to || *from == *to) return;
    // Both nodes list it.
    const auto [low, high] = std::minmax(*from, *to);
    if (!known_.emplace(low, high, motion.closure).second) return;
    // The number was reused: the motion belongs to another node.
    if (is_far(out_.graph.poses[*from] * motion.from_T_to, out_.graph.poses[*to])) return;
    tie(*from, *to, motion.information);
    if (motion.closure == 0) add_local(*from, *to, motion.information);
    if (motion.closure != 0) closures_.insert(motion.closure);
    ++out_.motions;
  }

  void add(std::span<const View> views) {
    std::map<std::size_t, View> seen;
    for (const View& one : views)
      if (const auto variable = find(one.node)) seen.emplace(*variable, one);
    if (seen.size() < 2) return;
    const Eigen::Vector2d at = place_of(seen);
    std::erase_if(seen, [&](const auto& one) {
      const geometry::SE2& pose = out_.graph.poses[one.first];
      return (pose * one.second.position_m - at).norm() > kAnother_m;
    });
    if (seen.size() < 2) return;

    const plane::PointId point = out_.graph.add_point(at);
    for (const auto& [variable, one] : seen) {
      out_.graph.observations.push_back(
          {pose_id(variable), point, out_.graph.poses[variable].inverse() * at, one.information});
    }
    for (auto next = std::next(seen.begin()); next != seen.end(); ++next)
      add_shared(at, *std::prev(next), *next);
    ++out_.shared;
  }

  void add(const map_file::StoredMap& map, const model::LoopClosure& closure) {
    if (closures_.contains(closure.id)) return;
    const auto from = end_part(map, closure.from);
    const auto to = end_part(map, closure.to);
    if (!from || !to || *from == *to) return;
    const Eigen::Vector3d sigma(kClosureSigma_m, kClosureSigma_m, kClosureSigma_rad);
    tie(*from, *to, sigma.array().square().inverse().matrix().asDiagonal());
  }

  /// Measures the variance per metre of path: the median over adjacent parts.
  void measure_drift() {
    std::array<std::vector<double>, 3> per_m;
    for (const auto& [pair, information] : local_) {
      const auto& [low, high] = pair;
      const bool is_step = high == low + 1 && high < out_.parts.size();
      if (!is_step || geometry::eigenvalues(information)[0] < kUndetermined) continue;
      const Eigen::Matrix3d covariance = geometry::symmetric_inverse(information);
      for (int k = 0; k < 3; ++k)
        per_m[static_cast<std::size_t>(k)].push_back(covariance(k, k) / step_m(low, high));
    }
    if (per_m[0].empty())
      throw ClosureError(
          "nothing is known of how its submaps lie to each other: they were stored by version "
          "0.2.0, or by another mapper");
    for (int k = 0; k < 3; ++k) {
      std::vector<double>& values = per_m[static_cast<std::size_t>(k)];
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      std::nth_element(values.begin(), middle, values.end());
      out_.drift_per_m[k] = *middle;
    }
  }

  /// Adds assumed motions between parts adjacent in time that no measurement connects. Parts
  /// without keyframes have no time of their own and come last.
  void fill_gaps() {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < out_.parts.size(); ++i)
      if (!out_.parts[i].keyframes.empty()) order.push_back(i);
    for (std::size_t i = 1; i < order.size(); ++i) assume(order[i - 1], order[i]);
    for (std::size_t i = 1; i < out_.parts.size(); ++i)
      if (out_.parts[i].keyframes.empty()) assume(i - 1, i);
  }

  PartGraph take() { return std::move(out_); }

 private:
  static plane::PoseId pose_id(std::size_t variable) {
    return plane::PoseId(static_cast<std::uint32_t>(variable));
  }
  static bool is_far(const geometry::SE2& a, const geometry::SE2& b) {
    const geometry::SE2 off = a.inverse() * b;
    return off.translation().norm() > kAnother_m || std::abs(off.theta()) > kAnother_rad;
  }

  /// Adds the other node of a motion with one node in a submap: a variable at the pose by the
  /// motion, fixed to its piece of the ground.
  void add_ground_node(const Motion& motion) {
    const auto from = find(motion.from);
    const auto to = find(motion.to);
    if (from.has_value() == to.has_value()) return;
    const std::size_t part = from ? *from : *to;
    if (part >= out_.parts.size()) return;
    const geometry::SE2 part_T_node = from ? motion.from_T_to : motion.from_T_to.inverse();
    const geometry::SE2 pose = out_.graph.poses[part] * part_T_node;
    variable_of_[from ? motion.to : motion.from] = out_.graph.poses.size();
    out_.graph.add_pose(pose);
    const std::size_t node = groups_.add();
    if (const auto piece = ground_beside(part, pose))
      tie(*piece, node, Eigen::Vector3d(kFast_m, kFast_m, kFast_rad).asDiagonal());
  }
  /// The piece of the ground, adjacent to the part in time, that contains the pose, if there is
  /// one.
  std::optional<std::size_t> ground_beside(std::size_t part, const geometry::SE2& pose) const {
    std::optional<std::size_t> best;
    double nearest_m = kInPiece_m;
    const std::size_t end = std::min(part + 2, out_.parts.size());
    for (std::size_t i = part == 0 ? 0 : part - 1; i < end; ++i) {
      const Part& one = out_.parts[i];
      const double distance_m = (one.map_T_part.translation() - pose.translation()).norm();
      if (one.submap != 0 || distance_m >= nearest_m) continue;
      nearest_m = distance_m;
      best = i;
    }
    return best;
  }

  void assume(std::size_t a, std::size_t b) {
    if (!groups_.join(a, b)) return;
    const Eigen::Vector3d variance = step_m(a, b) * out_.drift_per_m;
    tie(a, b, variance.cwiseInverse().asDiagonal());
    ++out_.assumed;
  }
  std::optional<std::size_t> find(NodeNumber node) const {
    const auto found = variable_of_.find(node);
    return found == variable_of_.end() ? std::nullopt : std::optional(found->second);
  }
  std::optional<std::size_t> end_part(const map_file::StoredMap& map,
                                      const model::LoopEnd& end) const {
    try {
      return placed_end(map, out_, end, "").part;
    } catch (const ClosureError&) {
      return std::nullopt;  // The end's place is no longer in the map.
    }
  }
  double step_m(std::size_t a, std::size_t b) const {
    const auto& poses = out_.graph.poses;
    return std::max(kLeastStep_m, (poses[a].translation() - poses[b].translation()).norm());
  }
  void tie(std::size_t from, std::size_t to, const Eigen::Matrix3d& information) {
    out_.graph.relative_poses.push_back({pose_id(from), pose_id(to),
                                         out_.graph.poses[from].inverse() * out_.graph.poses[to],
                                         information});
    if (geometry::eigenvalues(information)[0] > kUndetermined) groups_.join(from, to);
  }
  Eigen::Matrix3d& local(std::size_t low, std::size_t high) {
    return local_.try_emplace({low, high}, Eigen::Matrix3d::Zero()).first->second;
  }
  /// Stores it as information on low_T_high.
  void add_local(std::size_t from, std::size_t to, const Eigen::Matrix3d& information) {
    Eigen::Matrix3d turned = information;
    if (from > to) {
      // Log(high_T_low) is -Ad Log(low_T_high).
      const Eigen::Matrix3d adjoint =
          (out_.graph.poses[from].inverse() * out_.graph.poses[to]).inverse().Adjoint();
      turned = adjoint.transpose() * information * adjoint;
    }
    local(std::min(from, to), std::max(from, to)) += turned;
  }
  /// Adds a landmark's information on the motion between two parts that observed it.
  void add_shared(const Eigen::Vector2d& at, const std::pair<const std::size_t, View>& a,
                  const std::pair<const std::size_t, View>& b) {
    const geometry::SE2 a_T_b = out_.graph.poses[a.first].inverse() * out_.graph.poses[b.first];
    const Eigen::Matrix2d of_b =
        a_T_b.rotation() * b.second.information * a_T_b.rotation().transpose();
    const Eigen::Matrix2d weight =
        a.second.information * (a.second.information + of_b).inverse() * of_b;
    Eigen::Matrix<double, 2, 3> j;
    const Eigen::Vector2d in_b = out_.graph.poses[b.first].inverse() * at;
    j << a_T_b.rotation(), a_T_b.rotation() * geometry::perpendicular(in_b);
    const Eigen::Matrix3d information = j.transpose() * weight * j;
    local(a.first, b.first) += 0.5 * (information + information.transpose());
    if (++shared_[{a.first, b.first}] == kHoldingPair) groups_.join(a.first, b.first);
  }
  Eigen::Vector2d place_of(const std::map<std::size_t, View>& views) const {
    Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
    Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
    for (const auto& [variable, one] : views) {
      const geometry::SE2& pose = out_.graph.poses[variable];
      const Eigen::Matrix2d information =
          pose.rotation() * one.information * pose.rotation().transpose();
      sum += information;
      weighted += information * (pose * one.position_m);
    }
    return sum.inverse() * weighted;
  }

  PartGraph out_;
  Groups groups_;
  std::map<NodeNumber, std::size_t> variable_of_;
  std::set<std::tuple<std::size_t, std::size_t, std::uint64_t>> known_;
  std::set<std::uint64_t> closures_;
  /// Information between two variables, the earlier one first; right perturbation of the motion.
  std::map<std::pair<std::size_t, std::size_t>, Eigen::Matrix3d> local_;
  std::map<std::pair<std::size_t, std::size_t>, int> shared_;
};

}  // namespace

PartGraph part_graph(const map_file::StoredMap& map, std::span<const model::Submap> submaps,
                     const Ties& ties, std::span<const model::LoopClosure> closures) {
  Builder builder(parts_of(map, submaps), ties);
  for (const Motion& one : ties.motions) builder.add(one);
  for (const std::vector<View>& views : ties.landmarks) builder.add(views);
  for (const model::LoopClosure& one : closures) builder.add(map, one);
  builder.measure_drift();
  builder.fill_gaps();
  return builder.take();
}

PlacedEnd placed_end(const map_file::StoredMap& map, const PartGraph& graph,
                     const model::LoopEnd& end, const std::string& option) {
  for (std::size_t i = 0; i < graph.parts.size(); ++i) {
    const Part& part = graph.parts[i];
    if (end.submap != 0) {
      if (part.submap == end.submap) return {i, geometry::SE2()};
      continue;
    }
    for (const std::uint32_t k : part.keyframes) {
      if (map.keyframes[k].keyframe_sequence == end.keyframe)
        return {i, part.map_T_part.inverse() * map.keyframes[k].map_T_vehicle};
    }
  }
  const bool is_submap = end.submap != 0;
  throw ClosureError(fmt::format("{}map {} has no {} {}", option.empty() ? "" : option + ": ",
                                 map.map_id, is_submap ? "submap" : "keyframe",
                                 is_submap ? end.submap : end.keyframe));
}

}  // namespace understory::map_closure
