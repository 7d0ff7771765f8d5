#include "eval/metrics/oracle.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>

#include "common/geometry/alignment.hpp"

namespace understory::eval::metrics {
namespace {

constexpr double kRelineariseHeading = 4e-3;  // [rad]

/// The poses' block of one scan, with e_i = R z_i + t - l_i, unknowns (t, theta).
struct PoseBlock {
  std::vector<Eigen::Vector2d> lever;  ///< de_i / dtheta = R S z_i.
  Eigen::Matrix3d inverse;             ///< Of the 3 x 3 information.
};

PoseBlock pose_block(std::span<const Eigen::Vector2d> positions_m, double heading) {
  PoseBlock block;
  const geometry::SE2 turn(0.0, 0.0, heading);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector2d& z : positions_m) {
    const Eigen::Vector2d lever = geometry::perpendicular(turn * z);
    block.lever.push_back(lever);
    information.topLeftCorner<2, 2>() += Eigen::Matrix2d::Identity();
    information.topRightCorner<2, 1>() += lever;
    information.bottomLeftCorner<1, 2>() += lever.transpose();
    information(2, 2) += lever.squaredNorm();
  }
  block.inverse = information.inverse();
  return block;
}

Eigen::Matrix<double, 3, 2> transposed_jacobian(const Eigen::Vector2d& lever) {
  Eigen::Matrix<double, 3, 2> b;
  b << Eigen::Matrix2d::Identity(), lever.transpose();
  return b;
}

}  // namespace

int BatchOracle::landmark_of(std::uint32_t trunk) const {
  return trunk < landmark_of_trunk_.size() ? landmark_of_trunk_[trunk] : -1;
}

void BatchOracle::add(std::span<const Eigen::Vector2d> positions_m,
                      std::span<const std::uint32_t> trunks) {
  assert(positions_m.size() == trunks.size());
  Scan scan;
  geometry::RigidAlignment2 alignment;
  int known = 0;
  for (std::size_t i = 0; i < trunks.size(); ++i) {
    const int landmark = landmark_of(trunks[i]);
    if (landmark < 0) continue;
    alignment.add(landmarks_[landmark], positions_m[i]);
    ++known;
  }
  if (!scans_.empty() && known < 2) {
    throw std::invalid_argument("oracle: scan " + std::to_string(scans_.size()) +
                                " sees fewer than two known trunks");
  }
  if (!scans_.empty()) scan.pose = alignment.a_T_b();
  scan.linearised_heading = scan.pose.theta();
  for (std::size_t i = 0; i < trunks.size(); ++i) {
    int landmark = landmark_of(trunks[i]);
    if (landmark < 0) {
      landmark = static_cast<int>(landmarks_.size());
      if (trunks[i] >= landmark_of_trunk_.size()) landmark_of_trunk_.resize(trunks[i] + 1, -1);
      landmark_of_trunk_[trunks[i]] = landmark;
      trunks_.push_back(trunks[i]);
      landmarks_.push_back(scan.pose * positions_m[i]);
      observation_count_.push_back(0);
    }
    ++observation_count_[landmark];
    scan.positions_m.push_back(positions_m[i]);
    scan.landmarks.push_back(landmark);
  }
  grow_hessian();
  scans_.push_back(std::move(scan));
  update_hessian(scans_.back(), 1.0);
}

void BatchOracle::grow_hessian() {
  const auto needed = static_cast<Eigen::Index>(2 * landmarks_.size());
  if (needed <= hessian_.rows()) return;
  const Eigen::Index old = hessian_.rows();
  const Eigen::Index grown = std::max<Eigen::Index>(needed, 2 * old);
  Eigen::MatrixXd larger = Eigen::MatrixXd::Zero(grown, grown);
  larger.topLeftCorner(old, old) = hessian_;
  hessian_ = std::move(larger);
}

void BatchOracle::update_hessian(const Scan& scan, double sign) {
  const std::size_t n = scan.landmarks.size();

  for (const int landmark : scan.landmarks) {
    hessian_.diagonal().segment<2>(2 * landmark).array() += sign;
  }

  if (&scan == &scans_.front()) return;  // held fixed: nothing to eliminate
  const PoseBlock block = pose_block(scan.positions_m, scan.linearised_heading);

  for (std::size_t j = 0; j < n; ++j) {
    const Eigen::Matrix<double, 3, 2> right =
        sign * block.inverse * transposed_jacobian(block.lever[j]);
    for (std::size_t i = 0; i < n; ++i) {
      if (scan.landmarks[i] < scan.landmarks[j]) continue;
      hessian_.block<2, 2>(2 * scan.landmarks[i], 2 * scan.landmarks[j]).noalias() -=
          transposed_jacobian(block.lever[i]).transpose() * right;
    }
  }
}

void BatchOracle::place(Scan& scan) const {
  geometry::RigidAlignment2 alignment;
  for (std::size_t i = 0; i < scan.landmarks.size(); ++i) {
    alignment.add(landmarks_[scan.landmarks[i]], scan.positions_m[i]);
  }
  scan.pose = alignment.a_T_b();
}

void BatchOracle::relinearise() {
  for (Scan& scan : scans_) {
    if (std::abs(geometry::wrap_angle(scan.pose.theta() - scan.linearised_heading)) <
        kRelineariseHeading) {
      continue;
    }
    update_hessian(scan, -1.0);
    scan.linearised_heading = scan.pose.theta();
    update_hessian(scan, 1.0);
  }
}

Eigen::VectorXd BatchOracle::project_poses_and_descend() {
  Eigen::VectorXd descent = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(2 * landmarks_.size()));
  for (Scan& scan : scans_) {
    if (&scan != &scans_.front()) place(scan);
    const Eigen::Matrix2d rotation = scan.pose.rotation();
    for (std::size_t i = 0; i < scan.landmarks.size(); ++i) {
      const int landmark = scan.landmarks[i];
      descent.segment<2>(2 * landmark) +=
          rotation * scan.positions_m[i] + scan.pose.translation() - landmarks_[landmark];
    }
  }
  return descent;
}

BatchOracle::Solution BatchOracle::solve(double tolerance_m, int max_iterations) {
  const auto size = static_cast<Eigen::Index>(2 * landmarks_.size());
  Solution solution;

  Eigen::VectorXd descent = project_poses_and_descend();
  relinearise();
  factor_.compute(hessian_.topLeftCorner(size, size));
  if (factor_.info() != Eigen::Success) throw std::runtime_error("oracle: singular system");

  while (solution.iterations < max_iterations) {
    const Eigen::VectorXd step = factor_.solve(descent);
    for (std::size_t i = 0; i < landmarks_.size(); ++i) {
      landmarks_[i] += step.segment<2>(static_cast<Eigen::Index>(2 * i));
    }
    ++solution.iterations;
    solution.last_step_m = step.cwiseAbs().maxCoeff();
    descent = project_poses_and_descend();
    solution.converged = solution.last_step_m <= tolerance_m;
    if (solution.converged) break;
  }
  return solution;
}

Eigen::Matrix3d BatchOracle::covariance(std::size_t scan_index, double sigma_m) const {
  if (scan_index == 0) return Eigen::Matrix3d::Zero();
  const Scan& scan = scans_[scan_index];
  const PoseBlock block = pose_block(scan.positions_m, scan.pose.theta());
  Eigen::MatrixXd coupling =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(2 * landmarks_.size()), 3);
  for (std::size_t i = 0; i < scan.landmarks.size(); ++i) {
    coupling.middleRows<2>(2 * scan.landmarks[i]) =
        (block.inverse * transposed_jacobian(block.lever[i])).transpose();
  }
  const Eigen::Matrix3d in_map = block.inverse + coupling.transpose() * factor_.solve(coupling);
  Eigen::Matrix3d vehicle_R_map = Eigen::Matrix3d::Identity();
  vehicle_R_map.topLeftCorner<2, 2>() = scan.pose.rotation().transpose();
  return sigma_m * sigma_m * vehicle_R_map * in_map * vehicle_R_map.transpose();
}

}  // namespace understory::eval::metrics
