#include "eval/experiments/partition/baseline.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

#include "common/factor_graph/batch/batch.hpp"
#include "common/factor_graph/plane/optimise.hpp"
#include "eval/experiments/partition/baseline_submap.hpp"
#include "eval/tools/thread_clock.hpp"

namespace understory::eval::experiments::partition {
namespace {

namespace graph = factor_graph::graph;
namespace plane = factor_graph::plane;
using geoslam_mapper::smoothing::CutNode;
using geoslam_mapper::smoothing::CutPolicy;

/// Information of the pose that is held, and of a closure that is set by hand [1/m^2, 1/rad^2].
constexpr double kFirstHeld = 1e10;
constexpr double kManualClosure = 1e8;

std::vector<std::vector<plane::PointId>> observed_by_pose(const DriveGraph& drive) {
  std::vector<std::vector<plane::PointId>> observed(drive.graph.poses.size());
  for (const plane::PointObservation& one : drive.graph.observations)
    observed[index(one.pose)].push_back(one.point);
  return observed;
}

std::vector<CutNode> cut_nodes(const DriveGraph& drive) {
  const auto observed = observed_by_pose(drive);
  std::vector<CutNode> nodes;
  nodes.reserve(drive.graph.poses.size());
  double along_m = 0.0;
  for (std::size_t i = 0; i < drive.graph.poses.size(); ++i) {
    const geometry::SE2& pose = drive.graph.poses[i];
    if (i > 0) along_m += (pose.translation() - drive.graph.poses[i - 1].translation()).norm();
    nodes.push_back({along_m, pose.theta(), drive.scans_of_pose[i],
                     static_cast<std::uint32_t>(observed[i].size()), 0});
  }
  return nodes;
}

/// Counts what each node observes first, from `begin` on.
void count_new(const std::vector<std::vector<plane::PointId>>& observed, std::size_t begin,
               std::vector<CutNode>& nodes) {
  std::set<plane::PointId> seen;
  for (std::size_t i = begin; i < nodes.size(); ++i) {
    nodes[i].new_landmarks = 0;
    for (const plane::PointId point : observed[i])
      if (seen.insert(point).second) ++nodes[i].new_landmarks;
  }
}

geometry::SE2 pose_of_numbers(const Eigen::Vector3d& numbers) {
  return {numbers.x(), numbers.y(), numbers.z()};
}

/// The condensed submaps as one sparse graph, and its solution.
class CondensedGraph {
 public:
  CondensedGraph(const DriveGraph& drive, const std::vector<BaselineSubmap>& submaps,
                 Condensed form)
      : submaps_(submaps), form_(form) {
    shared_poses_.push_back(graph_.add(drive.graph.poses.front()));
    for (const BaselineSubmap& submap : submaps)
      shared_poses_.push_back(graph_.add(drive.graph.poses[submap.last]));
    graph_.add(graph::prior(shared_poses_.front(), drive.graph.poses.front(),
                            kFirstHeld * Eigen::Matrix3d::Identity()));
  }

  void add(std::size_t submap, const Relations& relations) {
    const BaselineSubmap& own = submaps_[submap];
    graph::CondensedFactor all;
    all.variables = {graph_.add(own.graph.poses[own.origin()]), shared_poses_[submap],
                     shared_poses_[submap + 1]};
    for (const std::size_t point : own.shared_points)
      all.variables.push_back(name(own.points[point], own.graph.points[point]));
    all.measurement = relations.mean;
    if (form_ == Condensed::kJointly) {
      all.information = relations.covariance.inverse();
      all.information = 0.5 * (all.information + all.information.transpose()).eval();
      graph_.add(all);
    } else {
      add_singly(all.variables, relations);
    }
  }

  void close(const geometry::SE2& first_T_last) {
    graph_.add(graph::relative(shared_poses_.front(), shared_poses_.back(), first_T_last,
                               kManualClosure * Eigen::Matrix3d::Identity()));
  }

  void solve() {
    const auto report = factor_graph::batch::optimise(graph_);
    if (!report.ok) throw std::runtime_error("the condensed graph: " + report.error);
  }

  /// Where the submap begins; of one more than the last: where that ends.
  geometry::SE2 entrance(std::size_t submap) const {
    return graph::pose2_of(graph_.value(shared_poses_[submap]));
  }
  std::vector<Eigen::Vector2d> shared_points(std::size_t submap) const {
    std::vector<Eigen::Vector2d> positions;
    positions.reserve(submaps_[submap].shared_points.size());
    for (const std::size_t point : submaps_[submap].shared_points)
      positions.push_back(
          graph::point2_of(graph_.value(points_.at(submaps_[submap].points[point]))));
    return positions;
  }

 private:
  graph::VariableId name(plane::PointId point, const Eigen::Vector2d& position) {
    const auto found = points_.find(point);
    if (found != points_.end()) return found->second;
    return points_.emplace(point, graph_.add(position)).first->second;
  }

  void add_singly(const std::vector<graph::VariableId>& variables, const Relations& relations) {
    Eigen::Index row = 0;
    for (const graph::VariableId variable : {variables[1], variables[2]}) {
      const geometry::SE2 origin_T_pose = pose_of_numbers(relations.mean.segment<3>(row));
      // The factor's residual is in the frame of the pose.
      Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
      turn.topLeftCorner<2, 2>() = origin_T_pose.rotation().transpose();
      const Eigen::Matrix3d covariance =
          turn * relations.covariance.block<3, 3>(row, row) * turn.transpose();
      graph_.add(graph::relative(variables[0], variable, origin_T_pose, inverse_of(covariance)));
      row += 3;
    }
    for (std::size_t i = 3; i < variables.size(); ++i, row += 2) {
      const Eigen::Matrix2d inverse = relations.covariance.block<2, 2>(row, row).inverse();
      const Eigen::Matrix2d information = 0.5 * (inverse + inverse.transpose());
      const Eigen::Vector2d position = relations.mean.segment<2>(row);
      graph_.add(graph::observation(variables[0], variables[i], position, information));
    }
  }
  static Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& covariance) {
    const Eigen::Matrix3d inverse = covariance.inverse();
    return 0.5 * (inverse + inverse.transpose());
  }

  const std::vector<BaselineSubmap>& submaps_;
  Condensed form_;
  graph::FactorGraph graph_;
  std::vector<graph::VariableId> shared_poses_;
  std::map<plane::PointId, graph::VariableId> points_;
};

std::vector<geometry::SE2> chain_of(const std::vector<BaselineSubmap>& submaps) {
  std::vector<geometry::SE2> poses{submaps.front().graph.poses.front()};
  for (const BaselineSubmap& submap : submaps) {
    const geometry::SE2 map_T_submap = poses.back() * submap.graph.poses.front().inverse();
    for (std::size_t i = 1; i < submap.graph.poses.size(); ++i)
      poses.push_back(map_T_submap * submap.graph.poses[i]);
  }
  return poses;
}

std::vector<geometry::SE2> expand_all(const std::vector<BaselineSubmap>& submaps,
                                      const CondensedGraph& condensed) {
  std::vector<geometry::SE2> poses{condensed.entrance(0)};
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    const std::vector<geometry::SE2> own = expand(
        submaps[i], condensed.entrance(i), condensed.entrance(i + 1), condensed.shared_points(i));
    poses.insert(poses.end(), own.begin() + 1, own.end());
  }
  return poses;
}

/// From the expanded solution as initial estimate (§2.3.3).
std::vector<geometry::SE2> solve_full(const DriveGraph& drive,
                                      const std::vector<geometry::SE2>& initial,
                                      const std::optional<geometry::SE2>& first_T_last) {
  plane::Graph whole = drive.graph;
  whole.poses = initial;
  if (first_T_last) {
    const auto last = plane::PoseId(static_cast<std::uint32_t>(whole.poses.size() - 1));
    whole.relative_poses.push_back(
        {plane::PoseId(0), last, *first_T_last, kManualClosure * Eigen::Matrix3d::Identity()});
  }
  if (const auto report = plane::optimise(whole); !report.ok)
    throw std::runtime_error("the full graph: " + report.error);
  return whole.poses;
}

}  // namespace

std::vector<std::size_t> cuts_of(const DriveGraph& drive, const CutPolicy& policy) {
  const auto observed = observed_by_pose(drive);
  std::vector<CutNode> nodes = cut_nodes(drive);
  std::vector<std::size_t> cuts;
  std::size_t begin = 0;
  for (;;) {
    count_new(observed, begin, nodes);
    const auto size = first_stretch(std::span<const CutNode>(nodes).subspan(begin), policy);
    // Behind the last cut there must be a submap, too.
    if (!size || begin + *size + 2 >= nodes.size()) return cuts;
    begin += *size;
    cuts.push_back(begin);
  }
}

std::vector<double> mean_landmarks(const DriveGraph& drive) {
  const std::vector<CutNode> nodes = cut_nodes(drive);
  std::vector<double> means;
  means.reserve(nodes.size());
  for (std::size_t pose = 0; pose < nodes.size(); ++pose) {
    double sum = 0.0;
    std::uint32_t scans = 0;
    for (std::size_t i = pose + 1; i > 0 && scans < CutPolicy::kSamples; --i) {
      const std::uint32_t counted = std::min(nodes[i - 1].scans, CutPolicy::kSamples - scans);
      sum += static_cast<double>(counted) * nodes[i - 1].landmarks;
      scans += counted;
    }
    means.push_back(scans > 0 ? sum / scans : 0.0);
  }
  return means;
}

BaselineSolution solve_by_submaps(const DriveGraph& drive, const BaselineOptions& options) {
  BaselineSolution solution;
  solution.cuts = cuts_of(drive, options.policy);
  std::vector<BaselineSubmap> submaps = submaps_of(drive, solution.cuts, options.shared);
  CondensedGraph condensed(drive, submaps, options.condensed);
  const auto count = static_cast<double>(submaps.size());
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    const double begin_s = tools::thread_time_s();
    optimise(submaps[i]);
    condensed.add(i, condense(submaps[i], options.propagation));
    solution.partition_ms += 1e3 * (tools::thread_time_s() - begin_s) / count;
    solution.iteration_ms += iteration_ms(submaps[i]) / count;
    solution.stored_bytes += stored_bytes(submaps[i]);
  }
  solution.chained = chain_of(submaps);

  const double begin_s = tools::thread_time_s();
  if (options.first_T_last) condensed.close(*options.first_T_last);
  condensed.solve();
  solution.expanded = expand_all(submaps, condensed);
  solution.closure_s = tools::thread_time_s() - begin_s;
  if (options.also_full) solution.full = solve_full(drive, solution.expanded, options.first_T_last);
  return solution;
}

}  // namespace understory::eval::experiments::partition
