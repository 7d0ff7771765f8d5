#include "services/geoslam_mapper/smoothing/frozen_part.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// Keeps a pose where it is: a micrometre, a microradian.
const Eigen::Matrix3d kHeld = 1e12 * Eigen::Matrix3d::Identity();
/// Updates of a part; a chain that is bent by metres takes some.
constexpr int kUpdates = 12;
/// They end where no pose moves by more [m].
constexpr double kSettled_m = 1e-5;

/// A part with its nodes as poses: the outer ones first.
struct Solved {
  plane::Smoother smoother;
  std::map<NodeIndex, plane::PoseId> pose_of;
};

/// `held`: how many of the outer nodes stay where they are.
std::optional<Solved> solve(const FrozenPart& part, const PoseOf& pose_of, std::size_t held) {
  plane::SmootherParameters parameters;
  parameters.relinearise_above = 1e-4;
  parameters.least_move = 1e-4;
  Solved solved{plane::Smoother(parameters), {}};
  const auto add = [&](NodeIndex node) {
    return solved.pose_of.emplace(node, solved.smoother.add_pose(pose_of(node))).first->second;
  };
  for (std::size_t i = 0; i < part.outer.size(); ++i) {
    const plane::PoseId pose = add(part.outer[i]);
    if (i < held) solved.smoother.add(plane::PosePrior{pose, pose_of(part.outer[i]), kHeld});
  }
  for (const NodeIndex node : part.inner) add(node);
  for (const FrozenMotion& one : part.motions) {
    solved.smoother.add(plane::RelativePose{solved.pose_of.at(one.a), solved.pose_of.at(one.b),
                                            one.a_T_b, one.information});
  }

  std::vector<geometry::SE2> before;
  for (const auto& [node, pose] : solved.pose_of) before.push_back(solved.smoother.pose(pose));
  for (int i = 0; i < kUpdates; ++i) {
    if (!solved.smoother.update().ok) return std::nullopt;
    double largest_m = 0.0;
    std::size_t at = 0;
    for (const auto& [node, pose] : solved.pose_of) {
      const geometry::SE2 now = solved.smoother.pose(pose);
      largest_m = std::max(largest_m, (now.translation() - before[at].translation()).norm());
      before[at++] = now;
    }
    if (largest_m < kSettled_m) break;
  }
  return solved;
}

/// The one that stands for a set of nodes.
NodeIndex root_of(NodeIndex node, std::map<NodeIndex, NodeIndex>& parent) {
  NodeIndex root = node;
  while (parent.at(root) != root) root = parent.at(root);
  while (parent.at(node) != root) node = std::exchange(parent.at(node), root);
  return root;
}

}  // namespace

std::vector<FrozenPart> parts_of(std::span<const FrozenMotion> motions,
                                 const std::set<NodeIndex>& frozen) {
  std::map<NodeIndex, NodeIndex> parent;
  for (const NodeIndex node : frozen) parent.emplace(node, node);
  for (const FrozenMotion& one : motions) {
    if (frozen.contains(one.a) && frozen.contains(one.b))
      parent[root_of(one.a, parent)] = root_of(one.b, parent);
  }

  std::map<NodeIndex, FrozenPart> parts;
  for (const NodeIndex node : frozen) parts[root_of(node, parent)].inner.push_back(node);
  for (const FrozenMotion& one : motions) {
    FrozenPart& part = parts.at(root_of(frozen.contains(one.a) ? one.a : one.b, parent));
    part.motions.push_back(one);
    for (const NodeIndex end : {one.a, one.b})
      if (!frozen.contains(end)) part.outer.push_back(end);
  }

  std::vector<FrozenPart> result;
  for (auto& [root, part] : parts) {
    std::ranges::sort(part.outer);
    part.outer.erase(std::unique(part.outer.begin(), part.outer.end()), part.outer.end());
    result.push_back(std::move(part));
  }
  return result;
}

std::optional<plane::CondensedPoses> condensed(const FrozenPart& part, const PoseOf& pose_of) {
  if (part.outer.size() < 2) return std::nullopt;
  const auto solved = solve(part, pose_of, 1);
  if (!solved) return std::nullopt;

  std::vector<plane::PoseId> others;
  for (std::size_t i = 1; i < part.outer.size(); ++i)
    others.push_back(solved->pose_of.at(part.outer[i]));
  const auto joint = solved->smoother.joint_marginal(others, {});
  if (!joint) return std::nullopt;

  plane::CondensedPoses result;
  const geometry::SE2 first_T_map =
      solved->smoother.pose(solved->pose_of.at(part.outer.front())).inverse();
  for (const plane::PoseId other : others)
    result.first_T_other.push_back(first_T_map * solved->smoother.pose(other));
  const Eigen::MatrixXd information = joint->inverse();
  result.information = 0.5 * (information + information.transpose());
  if (!result.information.allFinite()) return std::nullopt;
  return result;
}

std::vector<geometry::SE2> inner_poses(const FrozenPart& part, const PoseOf& pose_of) {
  std::vector<geometry::SE2> result;
  result.reserve(part.inner.size());
  const auto solved = solve(part, pose_of, part.outer.size());
  for (const NodeIndex node : part.inner)
    result.push_back(solved ? solved->smoother.pose(solved->pose_of.at(node)) : pose_of(node));
  return result;
}

}  // namespace understory::geoslam_mapper::smoothing
