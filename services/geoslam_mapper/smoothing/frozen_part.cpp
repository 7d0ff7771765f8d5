#include "services/geoslam_mapper/smoothing/frozen_part.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <functional>
#include <iterator>
#include <map>
#include <utility>

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// Holds a pose fixed: a micrometre, a microradian.
const Eigen::Matrix3d kHeld = 1e12 * Eigen::Matrix3d::Identity();
/// Weak prior on an outer node's initial pose while a part is solved [1/m^2, 1/rad^2]: a tie of few
/// landmarks may leave the pose undetermined, and so, nearly, may a long chain. It is subtracted
/// from the result exactly, and keeps the inverted matrix well conditioned.
constexpr double kLeash = 1e-2;
/// Share of an information's largest eigenvalue that is rounding.
constexpr double kRounding = 1e-15;
/// Most updates of a part; a chain that is bent by metres needs several.
constexpr int kUpdates = 12;
/// The updates end when no pose moves by more than this [m].
constexpr double kSettled_m = 1e-5;

/// A part with its nodes as poses: the outer ones first.
struct Solved {
  plane::Smoother smoother;
  std::map<NodeIndex, plane::PoseId> pose_of;
};

/// `held`: number of outer nodes that stay fixed; the others have the weak prior.
std::optional<Solved> solve(const FrozenPart& part, const PoseOf& pose_of, std::size_t held) {
  Solved solved;
  const auto add = [&](NodeIndex node) {
    return solved.pose_of.emplace(node, solved.smoother.add_pose(pose_of(node))).first->second;
  };
  for (std::size_t i = 0; i < part.outer.size(); ++i) {
    const plane::PoseId pose = add(part.outer[i]);
    const Eigen::Matrix3d information =
        i < held ? kHeld : Eigen::Matrix3d(kLeash * Eigen::Matrix3d::Identity());
    solved.smoother.add(plane::PosePrior{pose, pose_of(part.outer[i]), information});
  }
  for (const NodeIndex node : part.inner) add(node);
  for (const FrozenMotion& one : part.motions) {
    solved.smoother.add(plane::RelativePose{solved.pose_of.at(one.a), solved.pose_of.at(one.b),
                                            one.a_T_b, one.information});
  }

  std::vector<plane::CondensedPoses> earlier;
  for (const FrozenFactor& one : part.factors) {
    plane::CondensedPoses& factor = earlier.emplace_back(one.measured);
    factor.poses.clear();
    for (const NodeIndex node : one.nodes) factor.poses.push_back(solved.pose_of.at(node));
  }
  solved.smoother.set_condensed(earlier);

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

/// Connected sets of nodes (union-find).
class Bundles {
 public:
  explicit Bundles(const std::set<NodeIndex>& nodes) {
    for (const NodeIndex node : nodes) parent_.emplace(node, node);
  }

  bool contains(NodeIndex node) const { return parent_.contains(node); }
  void tie(NodeIndex a, NodeIndex b) { parent_[root_of(a)] = root_of(b); }
  /// The representative of a node's set.
  NodeIndex root_of(NodeIndex node) {
    NodeIndex root = node;
    while (parent_.at(root) != root) root = parent_.at(root);
    while (parent_.at(node) != root) node = std::exchange(parent_.at(node), root);
    return root;
  }

 private:
  std::map<NodeIndex, NodeIndex> parent_;
};

/// Joins the sets of these nodes, ignoring nodes without a set; returns one of the nodes, none if
/// all were ignored.
std::optional<NodeIndex> tie_all(std::span<const NodeIndex> nodes, Bundles& bundles) {
  std::optional<NodeIndex> first;
  for (const NodeIndex node : nodes) {
    if (!bundles.contains(node)) continue;
    if (first) bundles.tie(node, *first);
    first = node;
  }
  return first;
}

void add_outer(std::span<const NodeIndex> nodes, const Bundles& bundles, FrozenPart& part) {
  std::copy_if(nodes.begin(), nodes.end(), std::back_inserter(part.outer),
               [&](NodeIndex node) { return !bundles.contains(node); });
}

}  // namespace

std::vector<FrozenPart> parts_of(std::span<const FrozenMotion> motions,
                                 std::span<const FrozenFactor> factors,
                                 const std::set<NodeIndex>& nodes) {
  // Finds connected nodes.
  Bundles bundles(nodes);
  std::vector<std::pair<NodeIndex, const FrozenMotion*>> of_motions;
  for (const FrozenMotion& one : motions) {
    if (const auto node = tie_all(std::array{one.a, one.b}, bundles))
      of_motions.emplace_back(*node, &one);
  }
  std::vector<std::pair<NodeIndex, const FrozenFactor*>> of_factors;
  for (const FrozenFactor& one : factors)
    if (const auto node = tie_all(one.nodes, bundles)) of_factors.emplace_back(*node, &one);

  // The parts, and their outer nodes.
  std::map<NodeIndex, FrozenPart> parts;
  for (const NodeIndex node : nodes) parts[bundles.root_of(node)].inner.push_back(node);
  for (const auto& [node, one] : of_motions) {
    FrozenPart& part = parts.at(bundles.root_of(node));
    part.motions.push_back(*one);
    add_outer(std::array{one->a, one->b}, bundles, part);
  }
  for (const auto& [node, one] : of_factors) {
    FrozenPart& part = parts.at(bundles.root_of(node));
    part.factors.push_back(*one);
    add_outer(one->nodes, bundles, part);
  }

  // The origin of the map, node 0, last: in its frame the other nodes are one distant cluster, and
  // measurements within the cluster are lost in rounding.
  std::vector<FrozenPart> result;
  for (auto& [root, part] : parts) {
    std::ranges::sort(part.outer, std::greater{});
    part.outer.erase(std::unique(part.outer.begin(), part.outer.end()), part.outer.end());
    result.push_back(std::move(part));
  }
  return result;
}

std::optional<FrozenFactor> condensed(const FrozenPart& part, const PoseOf& pose_of) {
  if (part.outer.size() < 2) return std::nullopt;
  const auto solved = solve(part, pose_of, 1);
  if (!solved) return std::nullopt;

  std::vector<plane::PoseId> others;
  for (std::size_t i = 1; i < part.outer.size(); ++i)
    others.push_back(solved->pose_of.at(part.outer[i]));
  const auto joint = solved->smoother.joint_marginal(others, {});
  if (!joint) return std::nullopt;
  const Eigen::MatrixXd leashed = joint->inverse();
  if (!leashed.allFinite()) return std::nullopt;

  // Subtracts the weak prior: the result is positive semidefinite except for rounding.
  const Eigen::MatrixXd leash = kLeash * Eigen::MatrixXd::Identity(leashed.rows(), leashed.cols());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
      0.5 * (leashed + leashed.transpose()) - leash);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(0.0);
  const double least = kRounding * values.maxCoeff();
  const Eigen::VectorXd inverse_values =
      values.unaryExpr([&](double value) { return value > least ? 1.0 / value : 0.0; });

  // Mean of the measurement without the weak prior, which pulled the nodes towards their initial
  // poses.
  Eigen::VectorXd pulled(leashed.rows());
  for (std::size_t i = 0; i < others.size(); ++i) {
    const geometry::SE2 was_T_now =
        pose_of(part.outer[i + 1]).inverse() * solved->smoother.pose(others[i]);
    pulled.segment<3>(3 * static_cast<Eigen::Index>(i)) = was_T_now.Log();
  }
  const Eigen::VectorXd further = solver.eigenvectors() * inverse_values.asDiagonal() *
                                  solver.eigenvectors().transpose() * (leash * pulled);

  FrozenFactor factor{part.outer, {}};
  plane::CondensedPoses& result = factor.measured;
  const geometry::SE2 first_T_map =
      solved->smoother.pose(solved->pose_of.at(part.outer.front())).inverse();
  for (std::size_t i = 0; i < others.size(); ++i) {
    const Eigen::Vector3d one = further.segment<3>(3 * static_cast<Eigen::Index>(i));
    result.first_T_other.push_back(first_T_map * solved->smoother.pose(others[i]) *
                                   geometry::SE2::Exp(one));
  }
  result.information =
      solver.eigenvectors() * values.asDiagonal() * solver.eigenvectors().transpose();
  result.information = 0.5 * (result.information + result.information.transpose()).eval();
  return factor;
}

}  // namespace understory::geoslam_mapper::smoothing
