// Measurements between variables: the input of a factor graph.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "common/factor_graph/graph/variable.hpp"

namespace understory::factor_graph::graph {

/// Kind of measurement, with its residual e; a factor's cost is e' * information * e. `t`, `R`,
/// `theta`: of a pose; `p`: a point; `z`: the measurement; vec: of a unit quaternion with w >= 0.
enum class FactorKind : std::uint8_t {
  kPriorPose2,     ///< R_z' (t - t_z), theta - theta_z
  kPriorPose3,     ///< R_z' (t - t_z), 2 vec(q_z* q)
  kPriorPoint2,    ///< p - z
  kPriorPoint3,    ///< p - z
  kRelativePose2,  ///< R_z' (R_a' (t_b - t_a) - t_z), theta_b - theta_a - theta_z
  kRelativePose3,  ///< R_z' (R_a' (t_b - t_a) - t_z), 2 vec(q_z* q_a* q_b)
  kPoint2,         ///< R' (p - t) - z: a landmark in a pose's frame, Cartesian
  kPoint3,         ///< R' (p - t) - z
  kRangeBearing2,  ///< |R' (p - t)| - z_0 [m], direction of R' (p - t) - z_1 [rad]
  kPosition2,      ///< t + R * antenna - z: GNSS
  kPosition3,      ///< t + R * antenna - z
  /// As kRelativePose2, for a motion whose measured rotation is too large by b * seconds; b: a
  /// scalar, the bias of the yaw rate [rad/s].
  kBiasedRelativePose2,
  kPriorScalar,  ///< b - z
  kStepScalar,   ///< b_b - b_a
  kCondensed2,   ///< Several poses and points of the plane in the first variable's frame.
  kLinear,       ///< J (value - base) - b: what a marginalisation leaves.
  kUser,         ///< See UserFactor.
};

/// Loss of s = e' * information * e: s, and for large s as below with k the width [sigmas].
enum class RobustKernel : std::uint8_t {
  kNone,
  kHuber,         ///< 2 k sqrt(s) - k^2 beyond k^2
  kCauchy,        ///< k^2 log(1 + s / k^2)
  kGemanMcClure,  ///< s / (1 + s / k^2)
};

/// Loss of a factor.
struct Loss {
  RobustKernel kernel = RobustKernel::kNone;
  double width = 1.0;  ///< k [sigmas].
};

/// A loss at one s.
struct LossValue {
  double cost = 0.0;    ///< rho(s).
  double weight = 1.0;  ///< Its derivative, which is the factor's weight.
};
/// The loss at s = e' * information * e.
LossValue evaluate(const Loss& loss, double squared_error);

/// A factor of up to three variables.
struct Factor {
  FactorKind kind = FactorKind::kPriorPose2;
  int variable_count = 1;  ///< Number of used `variables`.
  std::array<VariableId, 3> variables{};
  /// Numbers of z as in Value [m, rad]; then further ones by kind (antenna, seconds).
  std::array<double, 7> measurement{};
  /// Inverse covariance of the residual.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6> information;
  Loss loss;
};

/// Index of the seconds in a kBiasedRelativePose2's measurement; the numbers before it are those of
/// a kRelativePose2.
constexpr std::size_t kBiasedSeconds = 5;

// Rows of an information are in the order of the residual above. Angles in rad, lengths in m.

/// Prior on a pose in the plane.
Factor prior(VariableId pose, const geometry::SE2& mean, const Eigen::Matrix3d& information);
/// Prior on a pose in space.
Factor prior(VariableId pose, const Pose3& mean, const Eigen::Matrix<double, 6, 6>& information);
/// Prior on a point in the plane.
Factor prior(VariableId point, const Eigen::Vector2d& mean, const Eigen::Matrix2d& information);
/// Prior on a point in space.
Factor prior(VariableId point, const Eigen::Vector3d& mean, const Eigen::Matrix3d& information);
/// A measured motion in the plane.
Factor relative(VariableId a, VariableId b, const geometry::SE2& a_T_b,
                const Eigen::Matrix3d& information);
/// A measured motion in space.
Factor relative(VariableId a, VariableId b, const Pose3& a_T_b,
                const Eigen::Matrix<double, 6, 6>& information);
/// A motion of `seconds`, measured with a yaw rate [rad/s] that is too large by `bias`: the heading
/// error is bias * seconds, the path is rotated by half of that.
Factor biased_relative(VariableId a, VariableId b, VariableId bias, const geometry::SE2& a_T_b,
                       double seconds, const Eigen::Matrix3d& information);
/// Prior on a scalar.
Factor prior(VariableId scalar, double mean, double information);
/// Two scalars whose difference is noise with mean zero.
Factor step(VariableId a, VariableId b, double information);
/// A point in a pose's frame, in the plane.
Factor observation(VariableId pose, VariableId point, const Eigen::Vector2d& position,
                   const Eigen::Matrix2d& information);
/// A point in a pose's frame, in space.
Factor observation(VariableId pose, VariableId point, const Eigen::Vector3d& position,
                   const Eigen::Matrix3d& information);
/// Range and bearing of a point from a pose, in the plane.
Factor range_bearing(VariableId pose, VariableId point, double range_m, double bearing_rad,
                     const Eigen::Matrix2d& information);
/// Position in the world of an antenna, given in the pose's frame; in the plane.
Factor position(VariableId pose, const Eigen::Vector2d& antenna, const Eigen::Vector2d& measured,
                const Eigen::Matrix2d& information);
/// The same in space.
Factor position(VariableId pose, const Eigen::Vector3d& antenna, const Eigen::Vector3d& measured,
                const Eigen::Matrix3d& information);

/// Condensed measurement: `variables[1..]` (pose2: x, y, theta; point2: x, y) in the frame of the
/// pose `variables[0]`, with their joint information.
struct CondensedFactor {
  std::vector<VariableId> variables;  ///< At least two.
  Eigen::VectorXd measurement;        ///< Values of variables[1..], concatenated [m, rad].
  Eigen::MatrixXd information;        ///< Inverse covariance of `measurement`.
  Loss loss;
};

/// A factor defined by a program.
class UserFactor {
 public:
  virtual ~UserFactor() = default;
  /// Rows of the residual.
  virtual int residual_dimension() const = 0;
  /// Whitened residual at `values` (one for each variable) and, unless null, its derivative:
  /// column-major, the columns of variable after variable. A pose2 is perturbed in (x, y, theta) of
  /// the world; a pose3 in its translation in the world and, on the right, in its rotation vector.
  virtual void evaluate(std::span<const Value> values, double* residual,
                        double* jacobian) const = 0;
};

/// Residual, and unless null its derivative in the sense of UserFactor, before whitening. `data`:
/// the measurement. Not for kLinear and kUser.
void evaluate(FactorKind kind, const double* data, std::span<const Value* const> values,
              std::span<const VariableType> types, double* residual, double* jacobian);
/// Rows of the residual; 0 for kinds with a size that depends on the data.
int residual_dimension(FactorKind kind);
/// The types required of a factor's variables; for condensed ones only of the first; none = any
/// type.
std::span<const VariableType> variable_types(FactorKind kind);

}  // namespace understory::factor_graph::graph
