#include "services/loop_closer/expectation.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "services/loop_closer/place_search.hpp"

namespace understory::loop_closer {
namespace {

/// Least standard deviations of an expectation [m], [rad]: for a drive's first metres, and for
/// errors that are missing in the covariances.
constexpr double kLeastM = 0.5;
constexpr double kLeastRad = 0.02;

}  // namespace

geometry::SE2WithCovariance expected(const Place& from, const Place& to) {
  geometry::SE2WithCovariance result = compound(inverse(from.map_T_base), to.map_T_base);
  result.covariance +=
      Eigen::Vector3d(kLeastM * kLeastM, kLeastM * kLeastM, kLeastRad * kLeastRad).asDiagonal();
  return result;
}

double squared_distance(const geometry::SE2WithCovariance& expected,
                        const geometry::SE2WithCovariance& found) {
  const Eigen::Vector3d off = (expected.mean.inverse() * found.mean).Log();
  return off.dot((expected.covariance + found.covariance).llt().solve(off));
}

double allowed_poses(std::span<const Place> places, const Place& query, double gate_sigmas,
                     double reach_m) {
  double poses = 0.0;
  for (const Place& place : places) {
    if (place.map_id != query.map_id) continue;
    const geometry::SE2WithCovariance pose = expected(place, query);
    const Eigen::Matrix2d covariance = pose.covariance.topLeftCorner<2, 2>();
    const double wide_m = gate_sigmas * std::sqrt(covariance.trace());
    if (pose.mean.translation().norm() > reach_m + wide_m) continue;

    const double ellipse_m2 =
        std::numbers::pi * gate_sigmas * gate_sigmas * std::sqrt(covariance.determinant());
    const double area_m2 = std::min(ellipse_m2, std::numbers::pi * reach_m * reach_m);
    const double turn_rad =
        std::min(2.0 * std::numbers::pi, 2.0 * gate_sigmas * std::sqrt(pose.covariance(2, 2)));
    poses +=
        std::max(1.0, area_m2 / (kPoseCellM * kPoseCellM)) * std::max(1.0, turn_rad / kPoseCellRad);
  }
  return poses;
}

}  // namespace understory::loop_closer
