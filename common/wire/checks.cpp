#include "common/wire/checks.hpp"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace understory {
namespace {

constexpr double kRounding = 1e-6;         // relative to the geometric mean of the diagonal
constexpr double kFarthestM = 1e7;         // no local frame of ours is larger than a country
constexpr double kLargestVariance = 1e14;  // its square

/// Entries over the square roots of the diagonal. A coordinate without variance must be
/// uncorrelated: nullopt otherwise, and where the diagonal is negative.
std::optional<Eigen::Matrix3d> correlations(const Eigen::Matrix3d& matrix) {
  Eigen::Matrix3d result = Eigen::Matrix3d::Identity();
  if ((matrix.diagonal().array() < 0.0).any()) return std::nullopt;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double scale = std::sqrt(matrix(i, i)) * std::sqrt(matrix(j, j));
      if (i == j) continue;
      if (scale == 0.0 && matrix(i, j) != 0.0) return std::nullopt;
      if (scale > 0.0) result(i, j) = matrix(i, j) / scale;
    }
  }
  return result;
}

}  // namespace

bool is_positive_semidefinite(const Eigen::Matrix3d& symmetric) {
  const auto correlation = correlations(symmetric);
  if (!correlation) return false;
  return correlation->cwiseAbs().maxCoeff() <= 1.0 + kRounding &&
         correlation->determinant() >= -kRounding;
}

void Checks::range(std::string_view field, double value, double lowest, double highest) {
  if (value >= lowest && value <= highest) return;
  refuse(Reason::kOutOfRange, field,
         std::to_string(value) + " is not in " + std::to_string(lowest) + " .. " +
             std::to_string(highest));
}

void Checks::consistent(bool holds, std::string_view what) {
  if (!holds) refuse(Reason::kInconsistent, what, "does not hold");
}

void Checks::pose(std::string_view field, const pose2_t& pose) {
  range(field, pose.x, -kFarthestM, kFarthestM);
  range(field, pose.y, -kFarthestM, kFarthestM);
  range(field, pose.theta, -std::numbers::pi - kRounding, std::numbers::pi + kRounding);
}

void Checks::check_covariance(std::string_view field, const Eigen::Matrix2d& matrix) {
  Eigen::Matrix3d padded = Eigen::Matrix3d::Zero();
  padded.topLeftCorner<2, 2>() = matrix;
  check_covariance(field, padded);
}

void Checks::check_covariance(std::string_view field, const Eigen::Matrix3d& matrix) {
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(matrix(i, i)) <= kLargestVariance)) {
      return refuse(Reason::kOutOfRange, field, "variance " + std::to_string(matrix(i, i)));
    }
    for (int j = 0; j < i; ++j) {
      const double scale = std::sqrt(std::abs(matrix(i, i))) * std::sqrt(std::abs(matrix(j, j)));
      if (!(std::abs(matrix(i, j) - matrix(j, i)) <= kRounding * scale)) {
        return refuse(Reason::kNotSymmetric, field, "is not symmetric");
      }
    }
  }
  if (!is_positive_semidefinite(0.5 * (matrix + matrix.transpose()))) {
    refuse(Reason::kNotPositive, field, "is not positive semidefinite");
  }
}

void Checks::refuse(Reason reason, std::string_view field, std::string_view what) {
  if (refusal_) return;
  std::string text;
  if (!array_.empty()) {
    text.append(array_).append(1, '[').append(std::to_string(index_)).append("].");
  }
  text.append(field).append(": ").append(what);
  refusal_ = Refusal{reason, std::move(text)};
}

}  // namespace understory
