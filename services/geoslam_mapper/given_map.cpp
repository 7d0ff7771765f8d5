#include "services/geoslam_mapper/given_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

#include "common/constellation/grid.hpp"
#include "common/map_file/chosen_map.hpp"
#include "services/geoslam_mapper/point_covariance.hpp"

namespace understory::geoslam_mapper {
namespace {

template <int N>
bool is_covariance(const Eigen::Matrix<double, N, N>& matrix) {
  if (!matrix.allFinite()) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(matrix,
                                                                          Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() >= 0.0;
}

bool is_sound(const model::MapLandmark& landmark) {
  return landmark.position_m.allFinite() && is_covariance<2>(landmark.covariance_m2);
}

/// Keyframes whose covariance is known, by place.
class KnownKeyframes {
 public:
  explicit KnownKeyframes(std::span<const model::KeyframePose> keyframes) {
    for (const model::KeyframePose& one : keyframes) {
      const Eigen::Vector2d at_m = one.map_T_vehicle.translation();
      if (!constellation::PointGrid::representable(at_m) ||
          !std::isfinite(one.map_T_vehicle.theta()))
        continue;
      if (one.covariance.isZero(0.0) || !is_covariance<3>(one.covariance)) continue;
      grid_.insert(static_cast<constellation::Slot>(known_.size()), at_m);
      known_.push_back({one.map_T_vehicle, one.covariance});
    }
  }

  /// The nearest one, map_T_vehicle; none where there is none. Looks further and further.
  const geometry::SE2WithCovariance* nearest_to(const Eigen::Vector2d& at_m) const {
    for (double radius_m = kCell_m; radius_m <= kAround_m; radius_m *= 4.0) {
      const geometry::SE2WithCovariance* nearest = nullptr;
      double least_m2 = std::numeric_limits<double>::infinity();
      grid_.for_each_within(at_m.x(), at_m.y(), radius_m, [&](constellation::Slot slot, double m2) {
        if (m2 >= least_m2) return;
        least_m2 = m2;
        nearest = &known_[slot];
      });
      if (nearest != nullptr) return nearest;
    }

    const auto nearest = std::ranges::min_element(
        known_, {}, [&](const auto& one) { return (one.mean.translation() - at_m).squaredNorm(); });
    return nearest == known_.end() ? nullptr : &*nearest;
  }

 private:
  static constexpr double kCell_m = 10.0;
  static constexpr double kAround_m = 640.0;  ///< Beyond, all of them are looked at.

  constellation::PointGrid grid_{kCell_m};
  std::vector<geometry::SE2WithCovariance> known_;
};

/// What is left of a covariance without its shared part, no less than `least_sigma_m`. Pose and
/// landmark are correlated otherwise as well, so nothing may be left.
Eigen::Matrix2d without(const Eigen::Matrix2d& covariance, const Eigen::Matrix2d& shared,
                        double least_sigma_m) {
  const double least_m2 = least_sigma_m * least_sigma_m;
  if (0.5 * covariance.trace() <= least_m2) return covariance;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance - shared);
  const Eigen::Vector2d left = solver.eigenvalues().cwiseMax(least_m2);
  return solver.eigenvectors() * left.asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace

model::WholeMap read_given_map(const std::string& file, int map_id) {
  const map_file::MapFile maps(file, map_file::Access::kRead);
  map_file::StoredMap stored = maps.read(map_file::chosen_map(maps, map_id));
  if (stored.landmarks.empty())
    throw std::runtime_error(file + ": map " + std::to_string(stored.map_id) + " has no landmark");

  model::WholeMap result;
  result.landmarks.reserve(stored.landmarks.size());
  for (const map_file::StoredLandmark& one : stored.landmarks)
    result.landmarks.push_back(one.landmark);
  result.keyframes = std::move(stored.keyframes);
  return result;
}

std::vector<model::MapLandmark> apart_from_keyframes(const model::WholeMap& map,
                                                     double least_sigma_m) {
  const KnownKeyframes keyframes(map.keyframes);
  std::vector<model::MapLandmark> result = map.landmarks;
  for (model::MapLandmark& landmark : result) {
    if (!constellation::PointGrid::representable(landmark.position_m)) continue;
    const geometry::SE2WithCovariance* const nearest = keyframes.nearest_to(landmark.position_m);
    if (nearest == nullptr) continue;

    const Eigen::Matrix2d shared =
        point_covariance(*nearest, nearest->mean.inverse() * landmark.position_m);
    landmark.covariance_m2 = without(landmark.covariance_m2, shared, least_sigma_m);
  }
  return result;
}

std::string why_not_given(const model::WholeMap& map) {
  if (!map.complete) return "the map is cut to bounds";
  if (map.landmarks.empty()) return "the map has no landmark";

  model::LandmarkId last = 0;
  for (const model::MapLandmark& landmark : map.landmarks) {
    if (landmark.id <= last || model::map_of(landmark.id) == 0)
      return "ids of landmarks must ascend and have the number of a map";
    if (!is_sound(landmark))
      return "landmark " + std::to_string(landmark.id) + " has a value that cannot be";
    last = landmark.id;
  }
  return {};
}

}  // namespace understory::geoslam_mapper
