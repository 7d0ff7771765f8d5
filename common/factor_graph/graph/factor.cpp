#include "common/factor_graph/graph/factor.hpp"

#include <cmath>

namespace understory::factor_graph::graph {
namespace {

template <typename Information>
Factor unary(FactorKind kind, VariableId variable, const Information& information) {
  Factor factor;
  factor.kind = kind;
  factor.variable_count = 1;
  factor.variables[0] = variable;
  factor.information = information;
  return factor;
}

template <typename Information>
Factor binary(FactorKind kind, VariableId a, VariableId b, const Information& information) {
  Factor factor = unary(kind, a, information);
  factor.variable_count = 2;
  factor.variables[1] = b;
  return factor;
}

template <typename Vector>
void set(Factor& factor, const Vector& measurement, std::size_t first = 0) {
  for (Eigen::Index i = 0; i < measurement.size(); ++i) {
    factor.measurement[first + static_cast<std::size_t>(i)] = measurement[i];
  }
}

}  // namespace

LossValue evaluate(const Loss& loss, double s) {
  const double k2 = loss.width * loss.width;
  switch (loss.kernel) {
    case RobustKernel::kNone:
      return {s, 1.0};
    case RobustKernel::kHuber: {
      if (s <= k2) return {s, 1.0};
      const double root = std::sqrt(s);
      return {2.0 * loss.width * root - k2, loss.width / root};
    }
    case RobustKernel::kCauchy:
      return {k2 * std::log1p(s / k2), 1.0 / (1.0 + s / k2)};
    case RobustKernel::kGemanMcClure: {
      const double weight = 1.0 / (1.0 + s / k2);
      return {s * weight, weight * weight};
    }
  }
  return {s, 1.0};
}

Factor prior(VariableId pose, const geometry::SE2& mean, const Eigen::Matrix3d& information) {
  Factor factor = unary(FactorKind::kPriorPose2, pose, information);
  set(factor, mean.coordinates());
  return factor;
}

Factor prior(VariableId pose, const Pose3& mean, const Eigen::Matrix<double, 6, 6>& information) {
  Factor factor = unary(FactorKind::kPriorPose3, pose, information);
  factor.measurement = value_of(mean);
  return factor;
}

Factor prior(VariableId point, const Eigen::Vector2d& mean, const Eigen::Matrix2d& information) {
  Factor factor = unary(FactorKind::kPriorPoint2, point, information);
  set(factor, mean);
  return factor;
}

Factor prior(VariableId point, const Eigen::Vector3d& mean, const Eigen::Matrix3d& information) {
  Factor factor = unary(FactorKind::kPriorPoint3, point, information);
  set(factor, mean);
  return factor;
}

Factor relative(VariableId a, VariableId b, const geometry::SE2& a_T_b,
                const Eigen::Matrix3d& information) {
  Factor factor = binary(FactorKind::kRelativePose2, a, b, information);
  // Includes cosine and sine of the rotation for every evaluation.
  const Value value = value_of(a_T_b);
  factor.measurement = value;
  return factor;
}

Factor biased_relative(VariableId a, VariableId b, VariableId bias, const geometry::SE2& a_T_b,
                       double seconds, const Eigen::Matrix3d& information) {
  Factor factor = relative(a, b, a_T_b, information);
  factor.kind = FactorKind::kBiasedRelativePose2;
  factor.variable_count = 3;
  factor.variables[2] = bias;
  factor.measurement[kBiasedSeconds] = seconds;
  return factor;
}

Factor prior(VariableId scalar, double mean, double information) {
  Factor factor =
      unary(FactorKind::kPriorScalar, scalar, Eigen::Matrix<double, 1, 1>::Constant(information));
  factor.measurement[0] = mean;
  return factor;
}

Factor step(VariableId a, VariableId b, double information) {
  return binary(FactorKind::kStepScalar, a, b, Eigen::Matrix<double, 1, 1>::Constant(information));
}

Factor relative(VariableId a, VariableId b, const Pose3& a_T_b,
                const Eigen::Matrix<double, 6, 6>& information) {
  Factor factor = binary(FactorKind::kRelativePose3, a, b, information);
  factor.measurement = value_of(a_T_b);
  return factor;
}

Factor observation(VariableId pose, VariableId point, const Eigen::Vector2d& position,
                   const Eigen::Matrix2d& information) {
  Factor factor = binary(FactorKind::kPoint2, pose, point, information);
  set(factor, position);
  return factor;
}

Factor observation(VariableId pose, VariableId point, const Eigen::Vector3d& position,
                   const Eigen::Matrix3d& information) {
  Factor factor = binary(FactorKind::kPoint3, pose, point, information);
  set(factor, position);
  return factor;
}

Factor range_bearing(VariableId pose, VariableId point, double range_m, double bearing_rad,
                     const Eigen::Matrix2d& information) {
  Factor factor = binary(FactorKind::kRangeBearing2, pose, point, information);
  set(factor, Eigen::Vector2d(range_m, bearing_rad));
  return factor;
}

Factor position(VariableId pose, const Eigen::Vector2d& antenna, const Eigen::Vector2d& measured,
                const Eigen::Matrix2d& information) {
  Factor factor = unary(FactorKind::kPosition2, pose, information);
  set(factor, measured);
  set(factor, antenna, 2);
  return factor;
}

Factor position(VariableId pose, const Eigen::Vector3d& antenna, const Eigen::Vector3d& measured,
                const Eigen::Matrix3d& information) {
  Factor factor = unary(FactorKind::kPosition3, pose, information);
  set(factor, measured);
  set(factor, antenna, 3);
  return factor;
}

int residual_dimension(FactorKind kind) {
  switch (kind) {
    case FactorKind::kPriorPose3:
    case FactorKind::kRelativePose3:
      return 6;
    case FactorKind::kPriorPose2:
    case FactorKind::kRelativePose2:
    case FactorKind::kBiasedRelativePose2:
    case FactorKind::kPriorPoint3:
    case FactorKind::kPoint3:
    case FactorKind::kPosition3:
      return 3;
    case FactorKind::kPriorPoint2:
    case FactorKind::kPoint2:
    case FactorKind::kRangeBearing2:
    case FactorKind::kPosition2:
      return 2;
    case FactorKind::kPriorScalar:
    case FactorKind::kStepScalar:
      return 1;
    case FactorKind::kCondensed2:
    case FactorKind::kLinear:
    case FactorKind::kUser:
      break;
  }
  return 0;
}

std::span<const VariableType> variable_types(FactorKind kind) {
  using enum VariableType;
  static constexpr std::array<VariableType, 2> kPoses2{kPose2, kPose2};
  static constexpr std::array<VariableType, 2> kPoses3{kPose3, kPose3};
  static constexpr std::array<VariableType, 2> kObserved2{kPose2, kPoint2};
  static constexpr std::array<VariableType, 2> kObserved3{kPose3, kPoint3};
  static constexpr std::array<VariableType, 3> kBiased2{kPose2, kPose2, kScalar};
  static constexpr std::array<VariableType, 2> kScalars{kScalar, kScalar};
  static constexpr std::array<VariableType, 1> kOnePoint2{kPoint2};
  static constexpr std::array<VariableType, 1> kOnePoint3{kPoint3};
  switch (kind) {
    case FactorKind::kPriorPose2:
    case FactorKind::kPosition2:
    case FactorKind::kCondensed2:
      return {kPoses2.data(), 1};
    case FactorKind::kPriorPose3:
    case FactorKind::kPosition3:
      return {kPoses3.data(), 1};
    case FactorKind::kPriorPoint2:
      return kOnePoint2;
    case FactorKind::kPriorPoint3:
      return kOnePoint3;
    case FactorKind::kRelativePose2:
      return kPoses2;
    case FactorKind::kRelativePose3:
      return kPoses3;
    case FactorKind::kBiasedRelativePose2:
      return kBiased2;
    case FactorKind::kPriorScalar:
      return {kScalars.data(), 1};
    case FactorKind::kStepScalar:
      return kScalars;
    case FactorKind::kPoint2:
    case FactorKind::kRangeBearing2:
      return kObserved2;
    case FactorKind::kPoint3:
      return kObserved3;
    case FactorKind::kLinear:
    case FactorKind::kUser:
      break;
  }
  return {};
}

}  // namespace understory::factor_graph::graph
