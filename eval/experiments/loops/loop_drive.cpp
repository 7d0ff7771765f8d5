#include "eval/experiments/loops/loop_drive.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>

namespace understory::eval::experiments::loops {
namespace {

/// Detections of one tree are so near to the mean of those before: this, or so many standard
/// deviations of what they show. A gate that is narrower than their noise would give the batch
/// solution those alone that happen to be right.
constexpr double kSameTreeM = 0.15;
constexpr double kSameTreeSigmas = 4.5;
/// ... but no wider than trees stand apart.
constexpr double kWidestM = 0.7;
/// Trees with fewer detections say little of their noise.
constexpr double kLeastDetections = 5.0;
/// Of the distance to the mean over the standard deviation per axis, where it is Gaussian.
constexpr double kRayleighMedian = 1.1774;
/// An odometry that states no error at all could not be told from a truth [m], [rad].
constexpr double kLeastSigmaM = 1e-4;
constexpr double kLeastSigmaRad = 1e-5;
/// The field of view ends so far beyond the farthest stem [m].
constexpr double kBeyondM = 1.0;

/// Trees by the true places of detections.
class Trees {
 public:
  /// Detections within `same_m` of a tree's mean are of it.
  explicit Trees(double same_m) : same_m_(same_m) {}

  int tree_at(const Eigen::Vector2d& place_m) {
    const auto [x, y] = cell_of(place_m);
    int nearest = -1;
    double nearest_m = same_m_;
    for (int i = x - 1; i <= x + 1; ++i) {
      for (int k = y - 1; k <= y + 1; ++k) {
        const auto found = cells_.find({i, k});
        if (found == cells_.end()) continue;
        for (const int tree : found->second) {
          const double distance_m = (trees_[static_cast<std::size_t>(tree)] - place_m).norm();
          if (distance_m >= nearest_m) continue;
          nearest_m = distance_m;
          nearest = tree;
        }
      }
    }
    if (nearest >= 0) {
      // Its cell stays that of its first detection.
      Eigen::Vector2d& mean_m = trees_[static_cast<std::size_t>(nearest)];
      double& count = counts_[static_cast<std::size_t>(nearest)];
      count += 1.0;
      mean_m += (place_m - mean_m) / count;
      return nearest;
    }
    trees_.push_back(place_m);
    counts_.push_back(1.0);
    cells_[{x, y}].push_back(static_cast<int>(trees_.size()) - 1);
    return static_cast<int>(trees_.size()) - 1;
  }
  std::size_t size() const { return trees_.size(); }
  const Eigen::Vector2d& place_m(int tree) const { return trees_[static_cast<std::size_t>(tree)]; }
  double detections(int tree) const { return counts_[static_cast<std::size_t>(tree)]; }

 private:
  std::pair<int, int> cell_of(const Eigen::Vector2d& place_m) const {
    return {static_cast<int>(std::floor(place_m.x() / same_m_)),
            static_cast<int>(std::floor(place_m.y() / same_m_))};
  }
  double same_m_;
  std::vector<Eigen::Vector2d> trees_;  ///< Mean place of each.
  std::vector<double> counts_;
  std::map<std::pair<int, int>, std::vector<int>> cells_;
};

/// How near detections of one tree are, by how much those of most trees are spread.
double same_tree_m(const std::vector<Eigen::Vector2d>& places) {
  Trees wide(kWidestM);
  std::vector<int> trees;
  trees.reserve(places.size());
  for (const Eigen::Vector2d& place : places) trees.push_back(wide.tree_at(place));

  std::vector<double> distances_m;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (wide.detections(trees[i]) >= kLeastDetections)
      distances_m.push_back((places[i] - wide.place_m(trees[i])).norm());
  }
  if (distances_m.empty()) return kSameTreeM;
  const auto middle = distances_m.begin() + static_cast<std::ptrdiff_t>(distances_m.size() / 2);
  std::nth_element(distances_m.begin(), middle, distances_m.end());
  return std::clamp(kSameTreeSigmas * *middle / kRayleighMedian, kSameTreeM, kWidestM);
}

class NoisyOdometry {
 public:
  NoisyOdometry(const LoopDriveOptions& options, std::uint64_t seed)
      : options_(options), random_(seed) {}

  model::Odometry between(const model::LandmarkScan& from, const model::LandmarkScan& to,
                          const geometry::SE2& motion) {
    const double along_m = 0.01 * options_.odometry_percent * motion.translation().norm();
    const double turn_rad = options_.odometry_deg * std::numbers::pi / 180.0;
    const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
    model::Odometry odometry;
    odometry.from_utime = from.utime;
    odometry.utime = to.utime;
    odometry.from_T_to = motion * geometry::SE2::Exp({along_m * x, along_m * y, turn_rad * z});
    const double sigma_m = std::max(along_m, kLeastSigmaM);
    const double sigma_rad = std::max(turn_rad, kLeastSigmaRad);
    odometry.covariance =
        Eigen::Vector3d(sigma_m * sigma_m, sigma_m * sigma_m, sigma_rad * sigma_rad).asDiagonal();
    odometry.has_wheels = true;
    return odometry;
  }

 private:
  const LoopDriveOptions& options_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
};

bool is_blind(std::size_t frame, std::size_t frames, const LoopDriveOptions& options) {
  const double share = static_cast<double>(frame) / static_cast<double>(frames);
  return share >= options.blind_from && share < options.blind_to;
}

void add_scans(const std::vector<model::StemFrame>& frames, const LoopDriveOptions& options,
               LoopDrive& drive) {
  double farthest_m = 0.0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    drive.scans.push_back(model::level_scan(frames[i], options.sigma_m, 1.0));
    drive.scans.back().sequence = i;
    if (is_blind(i, frames.size(), options)) drive.scans.back().detections.clear();
    for (const model::Detection& stem : drive.scans.back().detections)
      farthest_m = std::max(farthest_m, stem.position_m.head<2>().norm());
  }
  for (model::LandmarkScan& scan : drive.scans) {
    scan.field_of_view.max_range_m = farthest_m + kBeyondM;
    scan.field_of_view.width_rad = options.view_rad;
  }
}

}  // namespace

LoopDrive loop_drive(const std::string& name, const std::vector<model::StemFrame>& frames,
                     const LoopDriveOptions& options, std::uint64_t seed) {
  if (frames.size() < 2) throw std::invalid_argument(name + ": fewer than two frames");
  LoopDrive drive;
  drive.name = name;
  drive.truth_sigma = options.truth_sigma;
  add_scans(frames, options, drive);

  const geometry::SE2 first_T_world = model::level_pose(frames.front()).inverse();
  std::vector<Eigen::Vector2d> places;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    drive.truth.push_back(first_T_world * model::level_pose(frames[i]));
    for (const model::Detection& stem : drive.scans[i].detections)
      places.push_back(drive.truth[i] * stem.position_m.head<2>());
  }

  Trees trees(same_tree_m(places));
  NoisyOdometry noise(options, seed);
  geometry::SE2 reckoned;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    auto& of_frame = drive.trees.emplace_back();
    for (const model::Detection& stem : drive.scans[i].detections)
      of_frame.push_back(trees.tree_at(drive.truth[i] * stem.position_m.head<2>()));
    if (i == 0) continue;
    const geometry::SE2 motion = drive.truth[i - 1].inverse() * drive.truth[i];
    drive.length_m += motion.translation().norm();
    drive.odometry.push_back(noise.between(drive.scans[i - 1], drive.scans[i], motion));
    drive.odometry.back().sequence = i - 1;
    reckoned = reckoned * drive.odometry.back().from_T_to;
  }
  drive.tree_count = trees.size();
  drive.closing_error_m = (reckoned.translation() - drive.truth.back().translation()).norm();
  return drive;
}

}  // namespace understory::eval::experiments::loops
