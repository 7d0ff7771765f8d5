// The IMU's measurements over a block of scans.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/odometry_buffer.hpp"

namespace understory::keyframer::joint {

/// Estimate of the IMU's bias, in the axes of the vehicle.
struct BiasEstimate {
  model::InertialBias mean = model::InertialBias::Zero();  ///< (gyro, accelerometer's x and y).
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();    ///< In their units squared.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.mean, s.covariance);
  }
};

/// Information of one step: the inverse of the covariance of (yaw, velocity, position), exactly
/// symmetric and positive definite. A singular covariance is valid: from one sample between two
/// scans, an IMU at the vehicle's origin measures three numbers, which determine all five. Least
/// values are added: 1 microrad, 0.1 mm/s, 10 um, and 1/500 of the stated standard deviation in
/// every combination of the five. None if the matrix is no covariance: not finite, or with a
/// negative variance beyond the wire's tolerance for rounding. Only the lower triangle is read.
std::optional<Eigen::Matrix<double, 5, 5>> inertial_information(
    const Eigen::Matrix<double, 5, 5>& covariance);

/// The scans' velocities and the bias as unknowns beside their poses, eliminated: they constrain
/// the shape of a block far more than the stated errors of its steps do, since an unknown velocity
/// is common to all steps (Forster et al. 2017, in the plane). The result does not depend on the
/// frame of the poses.
class InertialChain {
 public:
  /// steps[k]: from pose k to pose k + 1, if an IMU measured it; one without an information (see
  /// inertial_information()) is skipped. `prior` is the bias before.
  InertialChain(std::span<const std::optional<model::InertialMotion>> steps,
                const BiasEstimate& prior);

  /// Adds the chain's information to the system of the poses (left perturbation: x, y, theta each),
  /// with the best velocities and bias at these poses. Cost O(n^3).
  void add_to(std::span<const geometry::SE2> poses, Eigen::MatrixXd& hessian,
              Eigen::VectorXd& gradient);

  /// Weighted squared error at the poses of the last add_to, and its degrees of freedom: measured
  /// numbers minus free unknowns beside the poses.
  double chi2() const { return chi2_; }
  int degrees_of_freedom() const { return degrees_of_freedom_; }
  /// The bias at the poses of the last add_to. The poses' covariance is `root`^T `root`.
  BiasEstimate bias(const Eigen::MatrixXd& root) const;

 private:
  struct Step {
    std::size_t from = 0;  ///< Index of its first pose.
    model::InertialMotion motion;
    Eigen::Matrix<double, 5, 5> information;  ///< Of (yaw, velocity, position).
  };

  void linearise(std::span<const geometry::SE2> poses, Eigen::MatrixXd& hessian,
                 Eigen::VectorXd& gradient);
  void add(const Step& step, std::span<const geometry::SE2> poses, Eigen::MatrixXd& hessian,
           Eigen::VectorXd& gradient);
  void add_standstill(const Step& step);
  Eigen::Index unknowns() const { return static_cast<Eigen::Index>(2 * poses_ + 3); }

  std::vector<Step> steps_;
  std::size_t poses_;
  BiasEstimate prior_;
  double chi2_ = 0.0;
  int degrees_of_freedom_ = 0;
  // At the last add_to: velocities, each in the axes of its scan, then the bias minus the prior's.
  Eigen::VectorXd value_;
  Eigen::MatrixXd hessian_;     ///< Of velocities and bias.
  Eigen::VectorXd gradient_;    ///< Likewise.
  Eigen::MatrixXd coupling_;    ///< Of poses (rows) with velocities and bias.
  Eigen::MatrixXd covariance_;  ///< hessian_^-1.
};

}  // namespace understory::keyframer::joint
