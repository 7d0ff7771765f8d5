#include "common/map_file/stored_map.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace understory::map_file {
namespace {

constexpr double kMostRadiusM = 1e3;
constexpr double kMostVariance = 1e18;
/// Rounding error of a covariance, relative to its largest variance.
constexpr double kRounding = 1e-9;
constexpr auto kMostSequence = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());

bool is_place(const Eigen::Vector2d& position_m) {
  return position_m.allFinite() && position_m.cwiseAbs().maxCoeff() <= kFarthestM;
}

template <int N>
bool is_covariance(const Eigen::Matrix<double, N, N>& matrix) {
  if (!matrix.allFinite() || matrix.cwiseAbs().maxCoeff() > kMostVariance) return false;
  const double scale = matrix.cwiseAbs().maxCoeff();
  if ((matrix - matrix.transpose()).cwiseAbs().maxCoeff() > kRounding * scale) return false;

  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(matrix,
                                                                          Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() >= -kRounding * scale;
}

std::string fault_of_one(const SubmapBorder& border) {
  if (border.submap_id > kMostSequence) return "its number is too large";
  if (border.corners_m.size() < 3) return "it has fewer than three corners";
  for (const Eigen::Vector2d& corner : border.corners_m) {
    if (!is_place(corner)) return "a corner is not finite or too far away";
  }
  return {};
}

std::string fault_of_one(const LoopClosure& loop) {
  if (loop.from_sequence > kMostSequence || loop.to_sequence > kMostSequence)
    return "a keyframe's number is too large";
  if (!is_place(loop.from_m) || !is_place(loop.to_m)) return "an end is not finite or too far away";
  return {};
}

std::string fault_of_one(const model::KeyframePose& pose) { return fault_of(pose); }

template <class Rows>
std::string fault_of_all(const Rows& rows, std::string_view what) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string fault = fault_of_one(rows[i]);
    if (!fault.empty()) return fmt::format("{} {}: {}", what, i + 1, fault);
  }
  return {};
}

std::string fault_of_landmarks(const StoredMap& map) {
  model::LandmarkId last = 0;
  for (const StoredLandmark& one : map.landmarks) {
    const model::LandmarkId id = one.landmark.id;
    std::string fault = fault_of(one, map.map_id);
    if (fault.empty() && id <= last) fault = "ids do not ascend";
    if (!fault.empty()) return fmt::format("landmark {}: {}", id, fault);
    last = id;
  }
  return {};
}

std::string fault_of_states(const StoredMap& map) {
  if (!map.existence) return {};
  std::vector<model::LandmarkId> ids;
  ids.reserve(map.landmarks.size());
  for (const StoredLandmark& one : map.landmarks) ids.push_back(one.landmark.id);
  return fault_of(*map.existence, ids);
}

}  // namespace

bool is_id_of(model::LandmarkId id, std::uint32_t map_id) {
  const std::uint32_t given_by = model::map_of(id);
  return given_by >= 1 && given_by <= map_id && id != landmark_id(given_by, 0);
}

void give_existence(StoredMap& map, const StoredExistence& existence) {
  map.existence = StoredExistence{existence.utime, existence.learned, {}};
  for (const ExistenceRow& row : existence.landmarks) {
    const auto found =
        std::ranges::lower_bound(map.landmarks, row.existence.id, {},
                                 [](const StoredLandmark& one) { return one.landmark.id; });
    if (found == map.landmarks.end() || found->landmark.id != row.existence.id) continue;
    found->existence = row.existence.probability;
    map.existence->landmarks.push_back(row);
  }
}

std::string fault_of(const StoredLandmark& one, std::uint32_t map_id) {
  const model::MapLandmark& landmark = one.landmark;
  if (!is_id_of(landmark.id, map_id)) return fmt::format("its id is none of map {}", map_id);
  if (!is_place(landmark.position_m)) return "its position is not finite or too far away";
  if (!is_covariance<2>(landmark.covariance_m2))
    return "its covariance is not positive semidefinite";
  if (!(landmark.radius_m >= 0.0 && landmark.radius_m <= kMostRadiusM))
    return "its radius is negative or too large";
  if (one.submap_id.value_or(0) > kMostSequence) return "its submap's number is too large";
  const double existence = one.existence.value_or(0.0);
  if (!(existence >= 0.0 && existence <= 1.0)) return "its existence is no probability";
  return {};
}

std::string fault_of(const model::KeyframePose& pose) {
  if (pose.keyframe_sequence > kMostSequence) return "its number is too large";
  if (!is_place(pose.map_T_vehicle.translation()))
    return "its position is not finite or too far away";
  if (!std::isfinite(pose.map_T_vehicle.theta())) return "its heading is not finite";
  if (!is_covariance<3>(pose.covariance)) return "its covariance is not positive semidefinite";
  return {};
}

std::string fault_of(const StoredMap& map) {
  if (map.map_id < 1 || map.map_id > kLastMapId)
    return fmt::format("its number is not within 1 to {}", kLastMapId);

  std::string fault = fault_of_landmarks(map);
  if (fault.empty()) fault = fault_of_all(map.keyframes, "keyframe");
  if (fault.empty()) fault = fault_of_all(map.submap_borders, "submap border");
  if (fault.empty()) fault = fault_of_all(map.loop_closures, "loop closure");
  if (fault.empty()) fault = fault_of_states(map);
  return fault;
}

}  // namespace understory::map_file
