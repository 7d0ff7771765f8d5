// The limit of the whole chain: batch maximum likelihood over the same detections, IMU and wheels,
// with true association.
#pragma once

#include <cstddef>
#include <vector>

#include "common/geometry/se2.hpp"
#include "eval/harness/chain_drive.hpp"
#include "sim/world.hpp"

namespace understory::eval::experiments::frontend {

/// Solves a drive's LANDMARKS and ODOMETRY whole. Detections have their stated covariances, scaled
/// per kind by what their residuals show; the gyro's bias is a random walk. A scan counts where the
/// vehicle moved since the one before: what a stationary laser errs does not average out. Errors of
/// detections count as white: where they last from scan to scan, as in a forest, it is no limit.
class ChainLimit {
 public:
  /// `run` with its measurements (`ChainOptions::keep_measurements`); a detection is of the true
  /// landmark of `world` within 0.5 m, one without is left out. Solves the whole drive; throws
  /// std::runtime_error where that does not converge.
  ChainLimit(const harness::ChainRun& run, const sim::World& world);

  /// Scans that count.
  std::size_t size() const { return scans_.size(); }
  /// Stamp of a scan.
  model::Utime utime(std::size_t scan) const { return scans_[scan].utime; }
  /// Poses of all scans by all data; the first one is the true one.
  const std::vector<metrics::StampedPose>& poses() const { return poses_; }
  /// Pose of a scan by the data up to it: what is possible at that time.
  metrics::StampedPose causal(std::size_t scan) const;
  /// Of trunks, corners: standard deviations that residuals show, over those stated.
  double trunk_noise() const { return noise_[0]; }
  double corner_noise() const { return noise_[1]; }

 private:
  /// One detection of a true landmark.
  struct Observation {
    std::size_t landmark = 0;
    std::size_t kind = 0;  ///< 0: trunk, 1: corner.
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  };
  /// A scan and the motion from the one before.
  struct Scan {
    model::Utime utime = 0;
    geometry::SE2 truth;
    std::vector<Observation> observations;
    geometry::SE2 motion;  ///< With the reference's bias taken out.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double seconds = 0.0;
  };
  /// Landmarks and poses of the first scans.
  struct Solution;

  void take_scans(const harness::ChainRun& run, const sim::World& world);
  void take_motions(const harness::ChainRun& run);
  Solution solve(std::size_t scans) const;
  void scale_noise(const Solution& solution);

  std::vector<Scan> scans_;
  std::vector<Eigen::Vector2d> landmarks_m_;  ///< True ones.
  double noise_[2] = {1.0, 1.0};
  std::vector<metrics::StampedPose> poses_;
};

/// The chain beside its limit.
struct LimitScore {
  double map_rms_m = 0.0;     ///< The map's keyframes at the end, after one rigid alignment.
  double batch_rms_m = 0.0;   ///< The batch's poses at the same stamps.
  std::size_t keyframes = 0;  ///< Compared.
  double pose_rms_m = 0.0;    ///< SLAM_POSE at some times, after one alignment.
  double causal_rms_m = 0.0;  ///< The causal limit at the same times.
  std::size_t times = 0;      ///< Compared.
  double trunk_noise = 1.0;   ///< Shown over stated.
  double corner_noise = 1.0;
};
/// `times`: how many, evenly over the drive; each is a batch solution.
LimitScore score_against_limit(const harness::ChainRun& run, const sim::World& world,
                               std::size_t times);

}  // namespace understory::eval::experiments::frontend
