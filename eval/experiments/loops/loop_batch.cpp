#include "eval/experiments/loops/loop_batch.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>

#include "common/factor_graph/batch/batch.hpp"

namespace understory::eval::experiments::loops {
namespace {

namespace graph = factor_graph::graph;

/// The first pose is the frame: known to a micrometre.
constexpr double kFixed = 1e12;

/// Times that the noise of detections is taken from the residuals of the last solution.
constexpr int kNoiseRounds = 2;

/// A tree is out of sight after so much path without a detection [m].
constexpr double kOutOfSightM = 100.0;
/// A place can be recognised where so many of the trees detected on the last metres were detected
/// before: fewer have one place in the drive by chance alone.
constexpr std::size_t kLeastTrees = 5;
constexpr double kWindowM = 40.0;

/// Path of the vehicle up to each frame [m].
std::vector<double> path_of(const LoopDrive& drive) {
  std::vector<double> along_m{0.0};
  for (std::size_t i = 1; i < drive.truth.size(); ++i)
    along_m.push_back(along_m.back() +
                      (drive.truth[i].translation() - drive.truth[i - 1].translation()).norm());
  return along_m;
}

/// Detections of trees, visit by visit: a tree that comes back into sight is a new one, unless the
/// place can be recognised during the visit.
class Visits {
 public:
  explicit Visits(const LoopDrive& drive) : drive_(drive), along_m_(path_of(drive)) {
    last_.assign(drive.tree_count, Visit{});
    for (std::size_t i = 0; i < drive.trees.size(); ++i) {
      enter(i);
      if (is_recognised(i)) link(i);
    }
  }

  /// Number of the tree, as far as it can be known, that detection `k` of frame `i` shows.
  std::size_t number(std::size_t i, std::size_t k) const { return root(numbers_[i][k]); }
  std::size_t size() const { return parents_.size(); }

 private:
  struct Visit {
    std::size_t number = 0;
    double seen_m = -1e9;
    bool is_known = false;  ///< There was an earlier visit.
    std::size_t earlier = 0;
  };

  void enter(std::size_t frame) {
    auto& numbers = numbers_.emplace_back();
    for (const int tree : drive_.trees[frame]) {
      Visit& visit = last_[static_cast<std::size_t>(tree)];
      if (along_m_[frame] - visit.seen_m > kOutOfSightM) {
        const bool was_seen = visit.seen_m >= 0.0;
        visit = {parents_.size(), 0.0, was_seen, visit.number};
        parents_.push_back(visit.number);
      }
      visit.seen_m = along_m_[frame];
      numbers.push_back(visit.number);
    }
  }

  /// Trees of the last metres that were there before.
  std::set<int> known_in_window(std::size_t frame) const {
    std::set<int> known;
    for (std::size_t j = frame + 1; j-- > 0 && along_m_[frame] - along_m_[j] <= kWindowM;)
      for (const int tree : drive_.trees[j])
        if (last_[static_cast<std::size_t>(tree)].is_known) known.insert(tree);
    return known;
  }
  bool is_recognised(std::size_t frame) const {
    return known_in_window(frame).size() >= kLeastTrees;
  }
  void link(std::size_t frame) {
    for (const int tree : known_in_window(frame)) {
      const Visit& visit = last_[static_cast<std::size_t>(tree)];
      parents_[root(visit.number)] = root(visit.earlier);
    }
  }
  std::size_t root(std::size_t number) const {
    while (parents_[number] != number) number = parents_[number];
    return number;
  }

  const LoopDrive& drive_;
  std::vector<double> along_m_;
  std::vector<Visit> last_;                        ///< Of each tree.
  std::vector<std::vector<std::size_t>> numbers_;  ///< Of each frame's detections.
  std::vector<std::size_t> parents_;
};

/// One detection of a tree that was detected twice or more.
struct Observed {
  std::size_t frame = 0;
  graph::VariableId point{};
  Eigen::Vector2d position_m;
};

class Batch {
 public:
  Batch(const LoopDrive& drive, Association association) : drive_(drive) {
    for (const geometry::SE2& pose : drive.truth) poses_.push_back(graph_.add(pose));
    graph_.add(graph::prior(poses_.front(), drive.truth.front(),
                            Eigen::Matrix3d(kFixed * Eigen::Matrix3d::Identity())));
    for (std::size_t i = 0; i < drive.odometry.size(); ++i) {
      const model::Odometry& motion = drive.odometry[i];
      graph_.add(graph::relative(poses_[i], poses_[i + 1], motion.from_T_to,
                                 Eigen::Matrix3d(motion.covariance.inverse())));
    }
    find_observed(association);
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
  void find_observed(Association association) {
    const Visits visits(drive_);
    const auto number_of = [&](std::size_t i, std::size_t k) {
      return association == Association::kTrue ? static_cast<std::size_t>(drive_.trees[i][k])
                                               : visits.number(i, k);
    };
    std::vector<int> seen(std::max(drive_.tree_count, visits.size()), 0);
    for (std::size_t i = 0; i < drive_.trees.size(); ++i)
      for (std::size_t k = 0; k < drive_.trees[i].size(); ++k) ++seen[number_of(i, k)];
    std::vector<std::optional<graph::VariableId>> points(seen.size());

    for (std::size_t i = 0; i < drive_.scans.size(); ++i) {
      for (std::size_t k = 0; k < drive_.scans[i].detections.size(); ++k) {
        const std::size_t tree = number_of(i, k);
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

std::vector<geometry::SE2> batch_poses(const LoopDrive& drive, Association association) {
  constexpr double kFirstSigmaM = 0.1;
  Batch batch(drive, association);
  batch.solve(kFirstSigmaM);
  for (int round = 0; round < kNoiseRounds; ++round)
    batch.solve(std::max(1e-3, batch.shown_sigma_m()));
  std::vector<geometry::SE2> result;
  for (std::size_t i = 0; i < drive.truth.size(); ++i) result.push_back(batch.pose(i));
  return result;
}

PathErrors batch_errors(const LoopDrive& drive, std::size_t first, Association association) {
  std::vector<geometry::SE2> poses = batch_poses(drive, association);
  const geometry::SE2 truth_T_batch = drive.truth[first] * poses[first].inverse();
  std::vector<std::size_t> frames;
  std::vector<geometry::SE2> aligned;
  for (std::size_t i = first; i < poses.size(); ++i) {
    frames.push_back(i);
    aligned.push_back(truth_T_batch * poses[i]);
  }
  return path_errors(drive, frames, aligned);
}

}  // namespace understory::eval::experiments::loops
