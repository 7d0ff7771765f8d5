#include "services/geoslam_mapper/given_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <stdexcept>

#include "common/map_file/chosen_map.hpp"

namespace understory::geoslam_mapper {
namespace {

bool is_sound(const model::MapLandmark& landmark) {
  if (!landmark.position_m.allFinite() || !landmark.covariance_m2.allFinite()) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(landmark.covariance_m2,
                                                              Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() >= 0.0;
}

}  // namespace

std::vector<model::MapLandmark> read_given_map(const std::string& file, int map_id) {
  const map_file::MapFile maps(file, map_file::Access::kRead);
  const map_file::StoredMap stored = maps.read(map_file::chosen_map(maps, map_id));
  if (stored.landmarks.empty())
    throw std::runtime_error(file + ": map " + std::to_string(stored.map_id) + " has no landmark");

  std::vector<model::MapLandmark> result;
  result.reserve(stored.landmarks.size());
  for (const map_file::StoredLandmark& one : stored.landmarks) result.push_back(one.landmark);
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
