#include "services/geoslam_mapper/given_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

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

/// Of keyframes within this distance of each other one is kept [m].
constexpr double kApart_m = 5.0;
/// Largest radius of the search in the grid [m]; beyond it all keyframes are compared.
constexpr double kAround_m = 640.0;

bool is_sound(const model::KeyframePose& keyframe) {
  const geometry::SE2& pose = keyframe.map_T_vehicle;
  return constellation::PointGrid::representable(pose.translation()) &&
         std::isfinite(pose.theta()) && !keyframe.covariance.isZero(0.0) &&
         is_covariance<3>(keyframe.covariance);
}

/// A covariance without its shared part, at least `least_sigma_m`. Pose and landmark are also
/// correlated otherwise, so the difference may be zero or negative.
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
  const GivenFrame frame(map);
  std::vector<model::MapLandmark> result = map.landmarks;
  for (model::MapLandmark& landmark : result) {
    if (!constellation::PointGrid::representable(landmark.position_m)) continue;
    const GivenFrame::Known* const nearest = frame.nearest_to(landmark.position_m);
    if (nearest == nullptr) continue;

    const Eigen::Matrix2d shared =
        point_covariance({nearest->map_T_vehicle, nearest->covariance},
                         nearest->map_T_vehicle.inverse() * landmark.position_m);
    landmark.covariance_m2 = without(landmark.covariance_m2, shared, least_sigma_m);
  }
  return result;
}

GivenFrame::GivenFrame(const model::WholeMap& map)
    : map_id_(map.landmarks.empty() ? 0 : model::map_of(map.landmarks.back().id)) {
  for (const model::KeyframePose& one : map.keyframes) {
    if (!is_sound(one)) continue;
    bool is_covered = false;
    const Eigen::Vector2d at_m = one.map_T_vehicle.translation();
    grid_.for_each_within(at_m.x(), at_m.y(), kApart_m,
                          [&](constellation::Slot, double) { is_covered = true; });
    if (is_covered) continue;
    grid_.insert(static_cast<constellation::Slot>(keyframes_.size()), at_m);
    keyframes_.push_back({one.map_T_vehicle, one.covariance});
  }
}

void GivenFrame::rebuild() {
  grid_ = constellation::PointGrid(kCell_m);
  for (std::size_t i = 0; i < keyframes_.size(); ++i)
    grid_.insert(static_cast<constellation::Slot>(i), keyframes_[i].map_T_vehicle.translation());
}

/// Searches in growing radii.
const GivenFrame::Known* GivenFrame::nearest_to(const Eigen::Vector2d& at_m) const {
  for (double radius_m = kCell_m; radius_m <= kAround_m; radius_m *= 4.0) {
    const Known* nearest = nullptr;
    double least_m2 = std::numeric_limits<double>::infinity();
    grid_.for_each_within(at_m.x(), at_m.y(), radius_m, [&](constellation::Slot slot, double m2) {
      if (m2 >= least_m2) return;
      least_m2 = m2;
      nearest = &keyframes_[slot];
    });
    if (nearest != nullptr) return nearest;
  }

  const auto nearest = std::ranges::min_element(keyframes_, {}, [&](const Known& one) {
    return (one.map_T_vehicle.translation() - at_m).squaredNorm();
  });
  return nearest == keyframes_.end() ? nullptr : &*nearest;
}

Eigen::Matrix3d GivenFrame::covariance_at(const geometry::SE2& map_T_vehicle) const {
  const Known* const nearest = nearest_to(map_T_vehicle.translation());
  if (nearest == nullptr) return Eigen::Matrix3d::Zero();
  const geometry::SE2WithCovariance keyframe_T_vehicle{
      nearest->map_T_vehicle.inverse() * map_T_vehicle, Eigen::Matrix3d::Zero()};
  return compound({nearest->map_T_vehicle, nearest->covariance}, keyframe_T_vehicle).covariance;
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
    if (!constellation::PointGrid::representable(landmark.position_m))
      return "landmark " + std::to_string(landmark.id) +
             " is more than 2,000 km from the map's origin, and nothing is located there: "
             "`understory map import --origin X,Y` moves it";
    last = landmark.id;
  }
  return {};
}

}  // namespace understory::geoslam_mapper
