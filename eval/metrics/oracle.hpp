// The limit of accuracy: batch maximum likelihood from all raw detections with true association.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"

namespace understory::eval::metrics {

/// Estimates one pose per scan and one position per trunk from detections of known trunks with
/// equal, isotropic noise. The frame is that of the first scan, which is held fixed.
///
/// For given landmarks the best pose of each scan follows in closed form, so the cost is a function
/// of the landmarks alone (variable projection). Its gradient is exact at every step; its
/// Gauss-Newton Hessian, the Schur complement of the poses' 3 x 3 blocks, changes so little from
/// state to state that a scan's part of it is made again only when its heading has moved. So a
/// state costs one dense Cholesky of 2 x landmarks and a few passes over the detections.
class BatchOracle {
 public:
  /// Adds a scan: detection i at positions_m[i] (vehicle frame) of trunk trunks[i].
  /// Precondition: from the second scan on, at least two of its trunks were observed before.
  void add(std::span<const Eigen::Vector2d> positions_m, std::span<const std::uint32_t> trunks);

  /// How the iteration ended.
  struct Solution {
    int iterations = 0;
    double last_step_m = 0.0;  ///< Largest movement of a landmark in the last iteration.
    bool converged = false;
  };
  /// Iterates until no landmark moves by more than `tolerance_m`.
  Solution solve(double tolerance_m = 1e-5, int max_iterations = 50);

  /// Scans taken so far.
  std::size_t scans() const { return scans_.size(); }
  /// Estimated pose of a scan in the frame of the first; as of the last solve().
  const geometry::SE2& first_T_vehicle(std::size_t scan) const { return scans_[scan].pose; }
  /// Trunks observed so far, in order of their first observation; landmark i is trunks()[i].
  std::span<const std::uint32_t> trunks() const { return trunks_; }
  /// Estimated positions, frame of the first scan.
  std::span<const Eigen::Vector2d> landmarks_m() const { return landmarks_; }
  /// Detections of each landmark so far.
  std::span<const std::uint32_t> observation_count() const { return observation_count_; }
  /// Index of the trunk's landmark, or -1.
  int landmark_of(std::uint32_t trunk) const;

  /// Covariance of a pose (tangent order, right perturbation) for detections with the given sigma
  /// per axis. Precondition: solve() after the last add().
  Eigen::Matrix3d covariance(std::size_t scan, double sigma_m) const;

 private:
  struct Scan {
    geometry::SE2 pose;
    double linearised_heading = 0.0;
    std::vector<Eigen::Vector2d> positions_m;
    std::vector<int> landmarks;
  };
  void place(Scan& scan) const;
  void update_hessian(const Scan& scan, double sign);
  void relinearise();
  Eigen::VectorXd project_poses_and_descend();
  void grow_hessian();

  std::vector<Scan> scans_;
  std::vector<std::uint32_t> trunks_;
  std::vector<int> landmark_of_trunk_;
  std::vector<Eigen::Vector2d> landmarks_;
  std::vector<std::uint32_t> observation_count_;
  Eigen::MatrixXd hessian_;  ///< Lower triangle; unit noise; grown ahead of need.
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace understory::eval::metrics
