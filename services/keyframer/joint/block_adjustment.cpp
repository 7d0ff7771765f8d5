#include "services/keyframer/joint/block_adjustment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

namespace understory::keyframer::joint {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
constexpr int kMaxIterations = 8;
constexpr double kConverged = 1e-9;
/// Least remaining information of a pose's parameter with the others free, as a share of that of
/// its observations: less is rounding.
constexpr double kLeastShare = 1e-10;
/// Of a pose without observations [1/m^2, 1/rad^2].
constexpr double kNoInformation = 1e-8;

/// d(centre point)/d(left perturbation of the member's pose).
Matrix23 point_jacobian(const Eigen::Vector2d& point) {
  Matrix23 jacobian;
  jacobian << Eigen::Matrix2d::Identity(), geometry::perpendicular(point);
  return jacobian;
}

/// Mirrors the lower triangle: exactly symmetric.
template <int N>
Eigen::Matrix<double, N, N> mirrored(Eigen::Matrix<double, N, N> matrix) {
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < i; ++j) matrix(j, i) = matrix(i, j);
  }
  return matrix;
}

/// root^T root: exactly symmetric, and positive semidefinite at any scale.
template <int N>
Eigen::Matrix<double, N, N> covariance_of(const Eigen::Matrix<double, Eigen::Dynamic, N>& root) {
  return mirrored<N>(root.transpose() * root);
}

/// Solves one problem. Poses are perturbed on the left here (in `centre`), so that a point's
/// Jacobian depends on the point alone.
class BlockAdjuster {
 public:
  explicit BlockAdjuster(const BlockProblem& problem)
      : problem_(problem),
        members_(problem.local_T_member.size()),
        landmarks_(problem.landmarks.size()) {
    const geometry::SE2 centre_T_local = problem.local_T_member[members_ / 2].inverse();
    for (const geometry::SE2& pose : problem.local_T_member)
      poses_.push_back(centre_T_local * pose);
    for (const Eigen::Vector2d& point : problem.landmarks)
      points_.push_back(centre_T_local * point);
    if (!problem.inertial.empty()) inertial_.emplace(problem.inertial, problem.bias);
  }

  BlockEstimate run() {
    BlockEstimate estimate;
    for (int i = 0; i < kMaxIterations && !estimate.converged; ++i) {
      linearise();
      estimate.converged = step() < kConverged;
    }
    linearise();
    finish(estimate);
    return estimate;
  }

 private:
  Eigen::Index dimension() const { return static_cast<Eigen::Index>(3 * members_); }

  void linearise() {
    reduced_ = Eigen::MatrixXd::Zero(dimension(), dimension());
    gradient_ = Eigen::VectorXd::Zero(dimension());
    landmark_hessian_.assign(landmarks_, Eigen::Matrix2d::Zero());
    landmark_gradient_.assign(landmarks_, Eigen::Vector2d::Zero());
    coupling_.assign(landmarks_, {});
    chi2_.clear();

    for (const BlockObservation& z : problem_.observations) add(z);
    for (std::size_t k = 0; k + 1 < members_ && k < problem_.motion.size(); ++k) {
      if (problem_.motion[k]) add_motion(k, *problem_.motion[k]);
    }
    if (inertial_) inertial_->add_to(poses_, reduced_, gradient_);
    information_ = reduced_.diagonal();
    for (std::size_t i = 0; i < landmarks_; ++i) eliminate(i);
  }

  void add(const BlockObservation& z) {
    const geometry::SE2& pose = poses_[z.member];
    const Eigen::Vector2d point = pose * z.position_m;

    // Error, weight and Jacobian in the axes of `centre`.
    const Eigen::Matrix2d rotation = pose.rotation();
    const Eigen::Matrix2d weight = rotation * z.covariance_m2.inverse() * rotation.transpose();
    const Eigen::Vector2d error = point - points_[z.landmark];
    const Matrix23 jacobian = point_jacobian(point);
    const Eigen::Matrix<double, 3, 2> weighted = jacobian.transpose() * weight;

    const Eigen::Index at = 3 * static_cast<Eigen::Index>(z.member);
    reduced_.block<3, 3>(at, at) += weighted * jacobian;
    gradient_.segment<3>(at) += weighted * error;
    landmark_hessian_[z.landmark] += weight;
    landmark_gradient_[z.landmark] -= weight * error;
    coupling_[z.landmark].push_back({at, -weighted});
    chi2_.push_back(error.dot(weight * error));
  }

  void add_motion(std::size_t k, const geometry::SE2WithCovariance& motion) {
    // Error Log(Z^-1 A^-1 B) with both poses perturbed on the left: dB = Ad(B^-1), dA = -Ad(B^-1),
    // times Jr^-1.
    const Eigen::Vector3d error =
        (motion.mean.inverse() * poses_[k].inverse() * poses_[k + 1]).Log();
    const Eigen::Matrix3d jacobian =
        geometry::inverse_right_jacobian(error) * poses_[k + 1].inverse().Adjoint();
    const Eigen::Matrix3d information = information_of(k, motion);
    const Eigen::Matrix3d hessian = jacobian.transpose() * information * jacobian;
    const Eigen::Vector3d gradient = jacobian.transpose() * information * error;

    const Eigen::Index a = 3 * static_cast<Eigen::Index>(k);
    const Eigen::Index b = a + 3;
    reduced_.block<3, 3>(a, a) += hessian;
    reduced_.block<3, 3>(b, b) += hessian;
    reduced_.block<3, 3>(a, b) -= hessian;
    reduced_.block<3, 3>(b, a) -= hessian;
    gradient_.segment<3>(b) += gradient;
    gradient_.segment<3>(a) -= gradient;
  }

  /// Without the rotation if the IMU gives it.
  Eigen::Matrix3d information_of(std::size_t k, const geometry::SE2WithCovariance& motion) const {
    const bool is_by_imu =
        inertial_ && problem_.inertial[k] && !problem_.inertial[k]->is_stationary;
    if (!is_by_imu) return motion.covariance.inverse();
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    information.topLeftCorner<2, 2>() = motion.covariance.topLeftCorner<2, 2>().inverse();
    return information;
  }

  void eliminate(std::size_t i) {
    if (coupling_[i].empty()) return;
    const Eigen::Matrix2d inverse = landmark_hessian_[i].inverse();
    for (const Coupling& a : coupling_[i]) {
      const Eigen::Matrix<double, 3, 2> scaled = a.block * inverse;
      gradient_.segment<3>(a.at) -= scaled * landmark_gradient_[i];
      for (const Coupling& b : coupling_[i]) {
        reduced_.block<3, 3>(a.at, b.at) -= scaled * b.block.transpose();
      }
    }
  }

  /// The reduced system with the constraint sum(delta) = 0. Adding C^T C does not change the
  /// solution, since the error does not depend on the gauge directions.
  Eigen::LDLT<Eigen::MatrixXd> factorised() const {
    Eigen::MatrixXd fixed = reduced_;
    const double scale = reduced_.diagonal().mean() / static_cast<double>(members_);
    for (std::size_t a = 0; a < members_; ++a) {
      for (std::size_t b = 0; b < members_; ++b) {
        fixed.block<3, 3>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b)) +=
            scale * Eigen::Matrix3d::Identity();
      }
    }
    return fixed.ldlt();
  }

  double step() {
    Eigen::VectorXd delta = -factorised().solve(gradient_);

    // The weights rotate with their members, which the linearisation neglects. Anisotropic weights
    // leave a small common motion that would never converge.
    Eigen::Vector3d common = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < members_; ++k) {
      common += delta.segment<3>(3 * static_cast<Eigen::Index>(k));
    }
    delta -= (common / static_cast<double>(members_)).replicate(dimension() / 3, 1);

    // Back-substitution: the landmarks, then the poses.
    for (std::size_t i = 0; i < landmarks_; ++i) {
      Eigen::Vector2d right = -landmark_gradient_[i];
      for (const Coupling& c : coupling_[i]) {
        right -= c.block.transpose() * delta.segment<3>(c.at);
      }
      if (!coupling_[i].empty()) points_[i] += landmark_hessian_[i].inverse() * right;
    }
    for (std::size_t k = 0; k < members_; ++k) {
      const Eigen::Vector3d xi = delta.segment<3>(3 * static_cast<Eigen::Index>(k));
      poses_[k] = geometry::SE2::Exp(xi) * poses_[k];
    }
    return delta.cwiseAbs().maxCoeff();
  }

  /// Square root of the poses' joint covariance (left perturbation, in `centre`): the covariance is
  /// root^T root. The gauge term adds 1/(scale n^2) along the common motion; the projection removes
  /// it. An undetermined motion gets the least information above rounding; then `is_determined`
  /// becomes false.
  Eigen::MatrixXd covariance_root(bool& is_determined) const {
    is_determined = true;
    if (members_ == 1) return Eigen::MatrixXd::Zero(3, 3);  // It defines the gauge.

    const Eigen::LDLT<Eigen::MatrixXd> factor = factorised();
    const Eigen::VectorXd information = factor.transpositionsP() * information_;
    Eigen::VectorXd pivots = factor.vectorD();
    for (Eigen::Index i = 0; i < pivots.size(); ++i) {
      const double least = std::max(kLeastShare * information(i), kNoInformation);
      if (pivots(i) > least) continue;
      is_determined = false;
      pivots(i) = least;
    }

    Eigen::MatrixXd root = Eigen::MatrixXd::Identity(dimension(), dimension());
    for (std::size_t a = 0; a < members_; ++a) {
      for (std::size_t b = 0; b < members_; ++b) {
        root.block<3, 3>(3 * static_cast<Eigen::Index>(a), 3 * static_cast<Eigen::Index>(b)) -=
            Eigen::Matrix3d::Identity() / static_cast<double>(members_);
      }
    }
    root = factor.transpositionsP() * root;
    factor.matrixL().solveInPlace(root);
    return pivots.cwiseSqrt().cwiseInverse().asDiagonal() * root;
  }

  void finish(BlockEstimate& estimate) const {
    const Eigen::MatrixXd root = covariance_root(estimate.determined);
    for (std::size_t k = 0; k < members_; ++k) {
      const Eigen::Matrix3d to_right = poses_[k].inverse().Adjoint();
      const Eigen::Matrix<double, Eigen::Dynamic, 3> own =
          root.middleCols<3>(3 * static_cast<Eigen::Index>(k)) * to_right.transpose();
      estimate.centre_T_member.push_back({poses_[k], covariance_of<3>(own)});
    }

    if (inertial_) {
      estimate.bias = inertial_->bias(root);
      estimate.inertial_chi2 = inertial_->chi2();
      estimate.inertial_degrees_of_freedom = inertial_->degrees_of_freedom();
    }
    estimate.landmarks = points_;
    estimate.chi2 = chi2_;
    for (std::size_t i = 0; i < landmarks_; ++i) {
      estimate.landmark_covariance.push_back(landmark_covariance(i, root));
    }
  }

  Eigen::Matrix2d landmark_covariance(std::size_t i, const Eigen::MatrixXd& root) const {
    if (coupling_[i].empty()) return Eigen::Matrix2d::Constant(std::nan(""));
    const Eigen::Matrix2d own = mirrored<2>(landmark_hessian_[i].inverse());
    Eigen::Matrix<double, Eigen::Dynamic, 2> shared = Eigen::MatrixXd::Zero(root.rows(), 2);
    for (const Coupling& a : coupling_[i]) shared += root.middleCols<3>(a.at) * a.block;
    return own + covariance_of<2>(shared * own);
  }

  struct Coupling {
    Eigen::Index at;                    ///< First parameter of the member's pose.
    Eigen::Matrix<double, 3, 2> block;  ///< d2/(d pose d landmark).
  };

  const BlockProblem& problem_;
  std::size_t members_;
  std::size_t landmarks_;
  std::vector<geometry::SE2> poses_;
  std::vector<Eigen::Vector2d> points_;
  Eigen::MatrixXd reduced_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd information_;  ///< Diagonal before the landmarks are eliminated.
  std::vector<Eigen::Matrix2d> landmark_hessian_;
  std::vector<Eigen::Vector2d> landmark_gradient_;
  std::vector<std::vector<Coupling>> coupling_;
  std::vector<double> chi2_;
  std::optional<InertialChain> inertial_;
};

}  // namespace

BlockEstimate adjust_block(const BlockProblem& problem) {
  if (problem.local_T_member.empty()) return {};
  return BlockAdjuster(problem).run();
}

}  // namespace understory::keyframer::joint
