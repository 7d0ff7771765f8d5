#include "services/geoslam_mapper/given_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <stdexcept>

#include "common/map_file/map_file.hpp"

namespace understory::geoslam_mapper {
namespace {

std::string numbers_of(const std::vector<map_file::MapSummary>& maps) {
  std::string result;
  for (const map_file::MapSummary& map : maps)
    result += (result.empty() ? "" : ", ") + std::to_string(map.map_id);
  return result;
}

/// The one that is asked for, where it can be told.
std::uint32_t chosen_map(const std::string& file, const map_file::MapFile& maps, int map_id) {
  const std::vector<map_file::MapSummary> all = maps.maps();
  // Merged maps leave trajectories of their own behind: maps without landmarks.
  const auto has_landmarks = [](const auto& map) { return map.trunks + map.corners > 0; };
  const auto only = std::ranges::find_if(all, has_landmarks);
  if (map_id == 0 && std::ranges::count_if(all, has_landmarks) == 1) return only->map_id;
  if (map_id == 0 && all.size() == 1) return all.front().map_id;

  for (const map_file::MapSummary& map : all)
    if (map_id > 0 && map.map_id == static_cast<std::uint32_t>(map_id)) return map.map_id;

  if (all.empty()) throw std::runtime_error(file + ": no map is in it");
  throw std::runtime_error(file + ": input.map_id is " + std::to_string(map_id) +
                           ", the file has map " + numbers_of(all) +
                           (map_id == 0 ? "; say which one" : ""));
}

bool is_sound(const model::MapLandmark& landmark) {
  if (!landmark.position_m.allFinite() || !landmark.covariance_m2.allFinite()) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(landmark.covariance_m2,
                                                              Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() >= 0.0;
}

}  // namespace

std::vector<model::MapLandmark> read_given_map(const std::string& file, int map_id) {
  const map_file::MapFile maps(file, map_file::Access::kRead);
  const map_file::StoredMap stored = maps.read(chosen_map(file, maps, map_id));
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
