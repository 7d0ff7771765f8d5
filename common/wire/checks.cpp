#include "common/wire/checks.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>

namespace understory::wire {
namespace {

constexpr double kRounding = 1e-6;         // relative to the geometric mean of the diagonal
constexpr double kFarthestM = 1e7;         // no local frame is larger than a country
constexpr double kLargestVariance = 1e14;  // its square

/// Short for any value: std::to_string would write all digits of 1e300.
std::string number(double value) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.begin(), text.end(), value, std::chars_format::general, 6).ptr;
  return {text.begin(), end};
}

/// Entries over the square roots of the diagonal. A coordinate without variance must be
/// uncorrelated: nullopt otherwise, and where the diagonal is negative.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> correlations(const Eigen::Matrix<double, N, N>& matrix) {
  Eigen::Matrix<double, N, N> result = Eigen::Matrix<double, N, N>::Identity();
  if ((matrix.diagonal().array() < 0.0).any()) return std::nullopt;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) {
      const double scale = std::sqrt(matrix(i, i)) * std::sqrt(matrix(j, j));
      if (i == j) continue;
      if (scale == 0.0 && matrix(i, j) != 0.0) return std::nullopt;
      if (scale > 0.0) result(i, j) = matrix(i, j) / scale;
    }
  }
  return result;
}

/// The fault of `matrix` as a covariance.
template <int N>
std::optional<Refusal> covariance_refusal(const Eigen::Matrix<double, N, N>& matrix) {
  for (int i = 0; i < N; ++i) {
    if (!(std::abs(matrix(i, i)) <= kLargestVariance)) {
      return Refusal{Reason::kOutOfRange, "variance " + number(matrix(i, i))};
    }
    for (int j = 0; j < i; ++j) {
      const double scale = std::sqrt(std::abs(matrix(i, i))) * std::sqrt(std::abs(matrix(j, j)));
      if (!(std::abs(matrix(i, j) - matrix(j, i)) <= kRounding * scale)) {
        return Refusal{Reason::kNotSymmetric, "is not symmetric"};
      }
    }
  }

  const Eigen::Matrix<double, N, N> symmetric = 0.5 * (matrix + matrix.transpose());
  if constexpr (N == 5) {
    if (is_positive_semidefinite_5(symmetric)) return std::nullopt;
  } else {
    if (is_positive_semidefinite(symmetric)) return std::nullopt;
  }

  return Refusal{Reason::kNotPositive, "is not positive semidefinite"};
}

}  // namespace

bool is_positive_semidefinite_5(const Eigen::Matrix<double, 5, 5>& symmetric) {
  const auto correlation = correlations<5>(symmetric);
  if (!correlation || correlation->cwiseAbs().maxCoeff() > 1.0 + kRounding) return false;
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 5, 5>>(*correlation,
                                                                    Eigen::EigenvaluesOnly)
             .eigenvalues()
             .minCoeff() >= -kRounding;
}

bool is_positive_semidefinite(const Eigen::Matrix3d& symmetric) {
  const auto correlation = correlations<3>(symmetric);
  if (!correlation) return false;
  return correlation->cwiseAbs().maxCoeff() <= 1.0 + kRounding &&
         correlation->determinant() >= -kRounding;
}

void Checks::range(std::string_view field, double value, double lowest, double highest) {
  if (value >= lowest && value <= highest) return;
  refuse(Reason::kOutOfRange, field,
         number(value) + " is not in " + number(lowest) + " .. " + number(highest));
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
  if (const auto why = covariance_refusal<3>(matrix)) refuse(why->reason, field, why->detail);
}

void Checks::check_covariance(std::string_view field, const Eigen::Matrix<double, 5, 5>& matrix) {
  if (const auto why = covariance_refusal<5>(matrix)) refuse(why->reason, field, why->detail);
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

}  // namespace understory::wire
