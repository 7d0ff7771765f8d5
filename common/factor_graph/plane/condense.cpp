#include "common/factor_graph/plane/condense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <vector>

namespace understory::factor_graph::plane {
namespace {

using Index = Eigen::Index;
using Block = Eigen::Matrix<double, 3, 2>;

/// Least pivot of a determined system [1/m^2, 1/rad^2].
constexpr double kLeastPivot = 1e-4;
/// Least information on a bias; less counts as none [1/(rad/s)^2].
constexpr double kLeastBiasInformation = 1.0;
/// Fewest points that define a common motion.
constexpr std::size_t kLeastPoints = 3;

/// An observation's share of the normal equations: pose' * point.
struct Cross {
  std::uint32_t pose = 0;
  Block block = Block::Zero();
};

/// A point of the normal equations.
struct PointBlock {
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< Covariance for given poses [m^2].
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  std::vector<Cross> observed;
};

/// The normal equations of the part with the middle inner pose fixed, points eliminated.
class PartSystem {
 public:
  PartSystem(const Graph& part, std::size_t inner)
      : part_(part), fixed_(inner / 2), points_(part.points.size()) {
    const auto size = 3 * static_cast<Index>(part.poses.size() - 1);
    information_.setZero(size, size);
    gradient_.setZero(size);
    bias_cross_.setZero(size);
  }

  /// False where a pose or a point is not determined.
  bool solve() {
    for (const RelativePose& factor : part_.relative_poses) add(factor, linearise(part_, factor));
    for (const BiasedRelativePose& factor : part_.biased_relative_poses) add(factor);
    if (!add_points()) return false;
    if (information_.size() == 0) return true;  // There is only the fixed pose.

    const Eigen::LLT<Eigen::MatrixXd> factorised(information_);
    if (factorised.info() != Eigen::Success) return false;
    const Eigen::MatrixXd& l = factorised.matrixLLT();
    if (l.diagonal().cwiseAbs2().minCoeff() < kLeastPivot) return false;
    covariance_ = factorised.solve(Eigen::MatrixXd::Identity(l.rows(), l.cols()));
    step_ = factorised.solve(-gradient_);

    // Solve for the bias, with the poses eliminated.
    by_bias_ = factorised.solve(-bias_cross_);
    bias_information_ += bias_cross_.dot(by_bias_);
    bias_gradient_ += bias_cross_.dot(step_);
    return true;
  }

  std::size_t fixed() const { return fixed_; }
  /// Joint covariance of the poses' moves, without the fixed pose.
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  /// The poses' moves to the optimum.
  const Eigen::VectorXd& step() const { return step_; }
  /// The poses' moves per bias.
  const Eigen::VectorXd& by_bias() const { return by_bias_; }
  /// Information on the bias.
  double bias_information() const { return bias_information_; }
  /// Move of the bias to the optimum, where there is information on it.
  double bias_step() const { return -bias_gradient_ / bias_information_; }
  const PointBlock& point(std::size_t i) const { return points_[i]; }
  /// Row of a pose in the system; none for the fixed pose.
  std::optional<Index> row(std::size_t pose) const {
    if (pose == fixed_) return std::nullopt;
    return 3 * static_cast<Index>(pose < fixed_ ? pose : pose - 1);
  }
  /// Derivative of a point by a pose that observed it: d(point)/d(pose).
  Eigen::Matrix<double, 2, 3> follows(std::size_t point, const Cross& cross) const {
    return -points_[point].covariance * cross.block.transpose();
  }

 private:
  template <typename Derived>
  void add_block(std::size_t a, std::size_t b, const Eigen::MatrixBase<Derived>& block) {
    const auto row_a = row(a);
    const auto row_b = row(b);
    if (row_a && row_b) information_.block<3, 3>(*row_a, *row_b) += block;
  }
  void add_gradient(std::size_t pose, const Eigen::Vector3d& gradient) {
    if (const auto at = row(pose)) gradient_.segment<3>(*at) += gradient;
  }

  void add(const RelativePose& factor, const RelativePoseJacobian& j) {
    const Eigen::Matrix3d weighted_a = factor.information * j.a;
    const Eigen::Matrix3d weighted_b = factor.information * j.b;
    const std::size_t a = index(factor.a);
    const std::size_t b = index(factor.b);
    add_block(a, a, j.a.transpose() * weighted_a);
    add_block(a, b, j.a.transpose() * weighted_b);
    add_block(b, a, j.b.transpose() * weighted_a);
    add_block(b, b, j.b.transpose() * weighted_b);
    add_gradient(a, weighted_a.transpose() * j.residual);
    add_gradient(b, weighted_b.transpose() * j.residual);
  }

  /// Adds the motion at the present bias, and the derivative of its residual by the bias.
  void add(const BiasedRelativePose& factor) {
    const RelativePose& motion = factor.motion;
    const double bias = part_[factor.bias];
    const geometry::SE2& measured = motion.a_T_b;
    const geometry::SE2 shift = measured.inverse() * at_true_rate(measured, bias, factor.seconds);
    RelativePoseJacobian j = linearise(part_, motion);
    j.residual -= shift.coordinates();
    add(motion, j);

    Eigen::Vector3d by_bias;
    by_bias << 0.5 * factor.seconds * measured.rotation().transpose() *
                   geometry::perpendicular(measured.translation()),
        factor.seconds;
    const Eigen::Vector3d weighted = motion.information * by_bias;
    if (const auto at = row(index(motion.a)))
      bias_cross_.segment<3>(*at) += j.a.transpose() * weighted;
    if (const auto at = row(index(motion.b)))
      bias_cross_.segment<3>(*at) += j.b.transpose() * weighted;
    bias_information_ += by_bias.dot(weighted);
    bias_gradient_ += weighted.dot(j.residual);
  }

  /// Adds the Schur complement of the points.
  bool add_points() {
    for (const PointObservation& factor : part_.observations) {
      const ObservationJacobian j = linearise(part_, factor);
      const Eigen::Matrix<double, 2, 3> weighted_pose = factor.information * j.pose;
      const std::size_t pose = index(factor.pose);
      PointBlock& point = points_[index(factor.point)];
      point.information += j.point.transpose() * factor.information * j.point;
      point.gradient += j.point.transpose() * factor.information * j.residual;
      point.observed.push_back({index(factor.pose), weighted_pose.transpose() * j.point});
      add_block(pose, pose, j.pose.transpose() * weighted_pose);
      add_gradient(pose, weighted_pose.transpose() * j.residual);
    }

    for (PointBlock& point : points_) {
      if (point.information.determinant() <= 0.0) return false;
      point.covariance = point.information.inverse();
      for (const Cross& one : point.observed) {
        const Block gain = one.block * point.covariance;
        add_gradient(one.pose, -gain * point.gradient);
        for (const Cross& other : point.observed)
          add_block(one.pose, other.pose, -gain * other.block.transpose());
      }
    }
    return true;
  }

  const Graph& part_;
  std::size_t fixed_;
  std::vector<PointBlock> points_;
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd bias_cross_;  ///< pose' * bias
  double bias_information_ = 0.0;
  double bias_gradient_ = 0.0;
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd step_;
  Eigen::VectorXd by_bias_;
};

/// d(point in the frame) / d(right perturbation of the frame), negative.
Eigen::Matrix<double, 2, 3> rigid(const Eigen::Vector2d& in_frame) {
  Eigen::Matrix<double, 2, 3> j;
  j << Eigen::Matrix2d::Identity(), geometry::perpendicular(in_frame);
  return j;
}

/// Derivative of the points' common frame by the poses: the fit of a rigid motion to the points'
/// moves, weighted by each point's information for given poses.
Eigen::MatrixXd common_motion(const Graph& part, const PartSystem& system) {
  const Eigen::Index size = system.step().size();  // 0 if the middle pose is the only pose.
  if (size == 0 || part.points.size() < kLeastPoints) return Eigen::MatrixXd::Zero(3, size);
  const geometry::SE2 middle_T_map = part.poses[system.fixed()].inverse();
  const Eigen::Matrix2d to_middle = middle_T_map.rotation();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(3, size);

  for (std::size_t i = 0; i < part.points.size(); ++i) {
    const PointBlock& point = system.point(i);
    const Eigen::Matrix2d weight = to_middle * point.information * to_middle.transpose();
    const Eigen::Matrix<double, 2, 3> j = rigid(middle_T_map * part.points[i]);
    normal += j.transpose() * weight * j;
    const Eigen::Matrix<double, 3, 2> gain = j.transpose() * weight * to_middle;
    for (const Cross& cross : point.observed) {
      if (const auto at = system.row(cross.pose))
        motion.middleCols<3>(*at) += gain * system.follows(i, cross);
    }
  }

  const Eigen::LLT<Eigen::Matrix3d> solver(normal);
  if (solver.info() != Eigen::Success) return Eigen::MatrixXd::Zero(3, size);
  return solver.solve(motion);
}

/// A pose relative to the origin: `common`: derivative of the origin by the poses; `spread`: common
/// * covariance.
geometry::SE2WithCovariance relative(const Graph& part, const PartSystem& system,
                                     const Eigen::MatrixXd& common, const Eigen::MatrixXd& spread,
                                     const geometry::SE2& map_T_origin, std::size_t pose) {
  geometry::SE2 map_T_pose = part.poses[pose];
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // between pose and origin
  if (const auto at = system.row(pose)) {
    map_T_pose = map_T_pose * geometry::SE2::Exp(system.step().segment<3>(*at));
    covariance = system.covariance().block<3, 3>(*at, *at);
    cross = spread.middleCols<3>(*at).transpose();
  }

  geometry::SE2WithCovariance result{map_T_origin.inverse() * map_T_pose, {}};
  const Eigen::Matrix3d adjoint = result.mean.inverse().Adjoint();
  const Eigen::Matrix3d mixed = cross * adjoint.transpose();
  result.covariance = covariance - mixed - mixed.transpose() +
                      adjoint * spread * common.transpose() * adjoint.transpose();
  result.covariance = 0.5 * (result.covariance + result.covariance.transpose()).eval();
  return result;
}

/// An outer pose and its derivative by the bias.
CondensedMotion motion_of(const Graph& part, const PartSystem& system,
                          const Eigen::MatrixXd& common, const Eigen::MatrixXd& spread,
                          const geometry::SE2& map_T_origin, std::size_t pose) {
  CondensedMotion result;
  result.origin_T_outer = relative(part, system, common, spread, map_T_origin, pose);
  const auto at = system.row(pose);
  if (at) result.seconds = common.row(2).dot(system.by_bias()) - system.by_bias()(*at + 2);
  return result;
}

/// The points relative to the origin: each one's own error, and the deformation by the poses'
/// errors.
std::vector<CondensedPoint> points_of(const Graph& part, const PartSystem& system,
                                      const Eigen::MatrixXd& common,
                                      const geometry::SE2& map_T_origin) {
  const geometry::SE2 origin_T_map = map_T_origin.inverse();
  const Eigen::Matrix2d to_origin = origin_T_map.rotation();
  std::vector<CondensedPoint> result(part.points.size());
  Eigen::MatrixXd bends(2 * static_cast<Index>(result.size()), common.cols());

  for (std::size_t i = 0; i < result.size(); ++i) {
    // Position by the part's own factors.
    const PointBlock& point = system.point(i);
    Eigen::Vector2d position = part.points[i] - point.covariance * point.gradient;
    auto bend = bends.middleRows<2>(2 * static_cast<Index>(i));
    bend.noalias() = -rigid(origin_T_map * part.points[i]) * common;
    for (const Cross& cross : point.observed) {
      const auto at = system.row(cross.pose);
      if (!at) continue;
      const Eigen::Matrix<double, 2, 3> follows = system.follows(i, cross);
      position += follows * system.step().segment<3>(*at);
      bend.middleCols<3>(*at) += to_origin * follows;
    }
    result[i].position = origin_T_map * position;
    result[i].covariance = to_origin * point.covariance * to_origin.transpose();
  }

  // For all points at once, because the poses' covariance is the large matrix of the product.
  const Eigen::MatrixXd spreads = bends * system.covariance();
  for (std::size_t i = 0; i < result.size(); ++i) {
    const auto row = 2 * static_cast<Index>(i);
    result[i].covariance +=
        spreads.middleRows<2>(row).lazyProduct(bends.middleRows<2>(row).transpose());
  }
  return result;
}

}  // namespace

std::optional<CondensedPart> condense(const Graph& part, std::size_t inner) {
  if (inner == 0) return std::nullopt;
  PartSystem system(part, inner);
  if (!system.solve()) return std::nullopt;

  CondensedPart result;
  const Eigen::MatrixXd common = common_motion(part, system);
  const Eigen::MatrixXd spread = common * system.covariance();
  const geometry::SE2& map_T_middle = part.poses[system.fixed()];
  const geometry::SE2 shifted =
      map_T_middle * geometry::SE2::Exp(Eigen::Vector3d(common * system.step()));

  result.origin_T_inner.reserve(inner);
  for (std::size_t pose = 0; pose < inner; ++pose)
    result.origin_T_inner.push_back(relative(part, system, common, spread, shifted, pose));
  result.outer.reserve(part.poses.size() - inner);
  for (std::size_t pose = inner; pose < part.poses.size(); ++pose)
    result.outer.push_back(motion_of(part, system, common, spread, shifted, pose));
  result.points = points_of(part, system, common, shifted);

  result.map_T_origin = map_T_middle;
  if (system.bias_information() > kLeastBiasInformation) {
    result.bias_step = system.bias_step();
    result.bias_information = system.bias_information();
  }
  return result;
}

}  // namespace understory::factor_graph::plane
