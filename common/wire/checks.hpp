// Common checks of conversions; the first failure is stored.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "common/geometry/se2.hpp"
#include "common/wire/result.hpp"
#include "understory/pose2_t.hpp"

namespace understory::wire {

/// A matrix in the form of the wire types: double name[N][N], row by row.
template <int N>
using SquareArray = double[N][N];

/// Stores the fault of one message. Fields may be checked in any order; checks after the first
/// failure are skipped.
class Checks {
 public:
  /// Sets the place of the following fields, e.g. detections[3]; empty = the message itself.
  void in(std::string_view array, std::size_t index) {
    array_ = array;
    index_ = index;
  }
  /// The following fields belong to the message itself.
  void in_message() { array_ = {}; }

  /// Refuses a value outside lowest .. highest (both included) as kOutOfRange; NaN fails.
  void range(std::string_view field, double value, double lowest, double highest);
  /// Refuses as kInconsistent where a relation between fields does not hold; `what` describes it.
  void consistent(bool holds, std::string_view what);
  /// Refuses a position beyond 10,000 km or a heading outside -pi .. pi.
  void pose(std::string_view field, const pose2_t& pose);
  /// Refuses a covariance that is not symmetric within rounding and positive semidefinite; returns
  /// the exactly symmetric one.
  template <int N>
  Eigen::Matrix<double, N, N> covariance(std::string_view field, const SquareArray<N>& rows) {
    const Eigen::Matrix<double, N, N> matrix =
        Eigen::Map<const Eigen::Matrix<double, N, N, Eigen::RowMajor>>(&rows[0][0]);
    check_covariance(field, matrix);
    return 0.5 * (matrix + matrix.transpose());
  }

  /// The first failure; none if all checks passed.
  const std::optional<Refusal>& refusal() const { return refusal_; }
  /// The value, moved from where it was made, or the first failure.
  template <class T>
  Result<T> result(T& value) const {
    if (refusal_) return *refusal_;
    return std::move(value);
  }

 private:
  void check_covariance(std::string_view field, const Eigen::Matrix2d& matrix);
  void check_covariance(std::string_view field, const Eigen::Matrix3d& matrix);
  void check_covariance(std::string_view field, const Eigen::Matrix<double, 5, 5>& matrix);
  void refuse(Reason reason, std::string_view field, std::string_view what);

  std::string_view array_;
  std::size_t index_ = 0;
  std::optional<Refusal> refusal_;
};

/// Whether a covariance (3 x 3, or 2 x 2 padded with zeros) is positive semidefinite within
/// rounding, for any scales of its coordinates.
bool is_positive_semidefinite(const Eigen::Matrix3d& symmetric);
/// The same for 5 x 5.
bool is_positive_semidefinite_5(const Eigen::Matrix<double, 5, 5>& symmetric);

}  // namespace understory::wire
