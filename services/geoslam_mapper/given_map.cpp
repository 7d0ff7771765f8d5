#include "services/geoslam_mapper/given_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <span>
#include <stdexcept>
#include <utility>

#include "common/map_file/chosen_map.hpp"
#include "services/geoslam_mapper/point_covariance.hpp"

namespace understory::geoslam_mapper {
namespace {

bool is_sound(const model::MapLandmark& landmark) {
  if (!landmark.position_m.allFinite() || !landmark.covariance_m2.allFinite()) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(landmark.covariance_m2,
                                                              Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() >= 0.0;
}

/// None without keyframes whose covariance is known.
const model::KeyframePose* nearest_to(const Eigen::Vector2d& position_m,
                                      std::span<const model::KeyframePose> keyframes) {
  const model::KeyframePose* nearest = nullptr;
  double least_m2 = std::numeric_limits<double>::infinity();
  for (const model::KeyframePose& one : keyframes) {
    const double m2 = (one.map_T_vehicle.translation() - position_m).squaredNorm();
    if (m2 >= least_m2 || one.covariance.isZero(0.0)) continue;
    least_m2 = m2;
    nearest = &one;
  }
  return nearest;
}

/// What is left of a covariance without its shared part, no less than `least_sigma_m` and no more
/// than there was. Pose and landmark are correlated otherwise as well, so nothing may be left.
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
  std::vector<model::MapLandmark> result = map.landmarks;
  for (model::MapLandmark& landmark : result) {
    const model::KeyframePose* nearest = nearest_to(landmark.position_m, map.keyframes);
    if (nearest == nullptr) continue;

    const geometry::SE2WithCovariance map_T_vehicle{nearest->map_T_vehicle, nearest->covariance};
    const Eigen::Matrix2d shared =
        point_covariance(map_T_vehicle, map_T_vehicle.mean.inverse() * landmark.position_m);
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
