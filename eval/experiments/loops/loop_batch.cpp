#include "eval/experiments/loops/loop_batch.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "common/factor_graph/batch/batch.hpp"

namespace understory::eval::experiments::loops {
namespace {

namespace graph = factor_graph::graph;

/// The first pose is the frame: known to a micrometre.
constexpr double kFixed = 1e12;

/// Times that the noise of detections is taken from the residuals of the last solution.
constexpr int kNoiseRounds = 2;

/// One detection of a tree that was detected twice or more.
struct Observed {
  std::size_t frame = 0;
  graph::VariableId point{};
  Eigen::Vector2d position_m;
};

class Batch {
 public:
  explicit Batch(const LoopDrive& drive) : drive_(drive) {
    for (const geometry::SE2& pose : drive.truth) poses_.push_back(graph_.add(pose));
    graph_.add(graph::prior(poses_.front(), drive.truth.front(),
                            Eigen::Matrix3d(kFixed * Eigen::Matrix3d::Identity())));
    for (std::size_t i = 0; i < drive.odometry.size(); ++i) {
      const model::Odometry& motion = drive.odometry[i];
      graph_.add(graph::relative(poses_[i], poses_[i + 1], motion.from_T_to,
                                 Eigen::Matrix3d(motion.covariance.inverse())));
    }
    find_observed();
  }

  void solve(double sigma_m) {
    for (const graph::FactorId factor : factors_) graph_.remove(factor);
    factors_.clear();
    const Eigen::Matrix2d information = Eigen::Matrix2d::Identity() / (sigma_m * sigma_m);
    for (const Observed& one : observed_)
      factors_.push_back(graph_.add(
          graph::observation(poses_[one.frame], one.point, one.position_m, information)));
    const factor_graph::batch::BatchReport report = factor_graph::batch::optimise(graph_);
    if (!report.ok) throw std::runtime_error(drive_.name + ": batch solution: " + report.error);
  }

  /// Of a detection, per axis [m]. Each tree takes two degrees of freedom.
  double shown_sigma_m() const {
    double squared = 0.0;
    for (const Observed& one : observed_) {
      const Eigen::Vector2d at = graph::point2_of(graph_.value(one.point));
      squared += (pose(one.frame).inverse() * at - one.position_m).squaredNorm();
    }
    const double freedom = 2.0 * static_cast<double>(observed_.size() - points_);
    return std::sqrt(squared / std::max(1.0, freedom));
  }

  geometry::SE2 pose(std::size_t frame) const {
    return graph::pose2_of(graph_.value(poses_[frame]));
  }

 private:
  void find_observed() {
    std::vector<int> seen(drive_.tree_count, 0);
    for (const auto& of_frame : drive_.trees)
      for (const int tree : of_frame) ++seen[static_cast<std::size_t>(tree)];
    std::vector<std::optional<graph::VariableId>> points(drive_.tree_count);

    for (std::size_t i = 0; i < drive_.scans.size(); ++i) {
      for (std::size_t k = 0; k < drive_.scans[i].detections.size(); ++k) {
        const auto tree = static_cast<std::size_t>(drive_.trees[i][k]);
        if (seen[tree] < 2) continue;
        const Eigen::Vector2d position_m = drive_.scans[i].detections[k].position_m.head<2>();
        if (!points[tree]) {
          points[tree] = graph_.add(Eigen::Vector2d(drive_.truth[i] * position_m));
          ++points_;
        }
        observed_.push_back({i, *points[tree], position_m});
      }
    }
  }

  const LoopDrive& drive_;
  graph::FactorGraph graph_;
  std::vector<graph::VariableId> poses_;
  std::vector<Observed> observed_;
  std::vector<graph::FactorId> factors_;
  std::size_t points_ = 0;
};

}  // namespace

std::vector<geometry::SE2> batch_poses(const LoopDrive& drive) {
  constexpr double kFirstSigmaM = 0.1;
  Batch batch(drive);
  batch.solve(kFirstSigmaM);
  for (int round = 0; round < kNoiseRounds; ++round)
    batch.solve(std::max(1e-3, batch.shown_sigma_m()));
  std::vector<geometry::SE2> result;
  for (std::size_t i = 0; i < drive.truth.size(); ++i) result.push_back(batch.pose(i));
  return result;
}

}  // namespace understory::eval::experiments::loops
