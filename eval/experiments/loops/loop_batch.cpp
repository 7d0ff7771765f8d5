#include "eval/experiments/loops/loop_batch.hpp"

#include <Eigen/LU>
#include <array>
#include <optional>
#include <stdexcept>

#include "common/factor_graph/batch/batch.hpp"

namespace understory::eval::experiments::loops {
namespace {

namespace graph = factor_graph::graph;

/// The first pose is the frame: known to a micrometre.
constexpr double kFixed = 1e12;

void add_observations(const LoopDrive& drive, std::span<const graph::VariableId> poses,
                      graph::FactorGraph& all) {
  std::vector<int> seen(drive.tree_count, 0);
  for (const auto& of_frame : drive.trees)
    for (const int tree : of_frame) ++seen[static_cast<std::size_t>(tree)];
  std::vector<std::optional<graph::VariableId>> points(drive.tree_count);

  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    for (std::size_t k = 0; k < drive.scans[i].detections.size(); ++k) {
      const auto tree = static_cast<std::size_t>(drive.trees[i][k]);
      if (seen[tree] < 2) continue;
      const model::Detection& detection = drive.scans[i].detections[k];
      const Eigen::Vector2d position_m = detection.position_m.head<2>();
      if (!points[tree]) points[tree] = all.add(Eigen::Vector2d(drive.truth[i] * position_m));
      const Eigen::Matrix2d covariance_m2 = detection.covariance_m2.topLeftCorner<2, 2>();
      all.add(graph::observation(poses[i], *points[tree], position_m, covariance_m2.inverse()));
    }
  }
}

}  // namespace

std::vector<geometry::SE2> batch_poses(const LoopDrive& drive) {
  graph::FactorGraph all;
  std::vector<graph::VariableId> poses;
  for (const geometry::SE2& pose : drive.truth) poses.push_back(all.add(pose));
  all.add(graph::prior(poses.front(), drive.truth.front(),
                       Eigen::Matrix3d(kFixed * Eigen::Matrix3d::Identity())));
  for (std::size_t i = 0; i < drive.odometry.size(); ++i) {
    const model::Odometry& motion = drive.odometry[i];
    all.add(graph::relative(poses[i], poses[i + 1], motion.from_T_to,
                            Eigen::Matrix3d(motion.covariance.inverse())));
  }
  add_observations(drive, poses, all);

  const factor_graph::batch::BatchReport report = factor_graph::batch::optimise(all);
  if (!report.ok) throw std::runtime_error(drive.name + ": batch solution: " + report.error);
  std::vector<geometry::SE2> result;
  for (const graph::VariableId pose : poses) result.push_back(graph::pose2_of(all.value(pose)));
  return result;
}

}  // namespace understory::eval::experiments::loops
