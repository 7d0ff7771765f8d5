#include "services/geoslam_mapper/smoothing/map_units.hpp"

#include <cmath>

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Least change of the factor that makes a step: 3 cm at 300 m.
constexpr double kStep = 1e-4;

}  // namespace

void MapUnits::follow(double map_factor) {
  if (std::abs(map_factor - factor_) < kStep) return;
  factor_ = map_factor;
  stepped_ = true;
}

geometry::SE2 MapUnits::metres(const geometry::SE2& pose) const {
  return {factor_ * pose.translation(), pose.theta()};
}

model::MapUpdate MapUnits::metres(model::MapUpdate update) const {
  update.map_T_vehicle = metres(update.map_T_vehicle);
  update.map_T_latest_vehicle = metres(update.map_T_latest_vehicle);
  return update;
}

ScanPose MapUnits::metres(ScanPose pose) const {
  pose.map_T_vehicle.mean = metres(pose.map_T_vehicle.mean);
  return pose;
}

std::vector<model::MapLandmark> MapUnits::metres(std::vector<model::MapLandmark> landmarks) const {
  for (model::MapLandmark& one : landmarks) one.position_m *= factor_;
  return landmarks;
}

std::vector<model::KeyframePose> MapUnits::metres(std::vector<model::KeyframePose> poses) const {
  for (model::KeyframePose& one : poses) one.map_T_vehicle = metres(one.map_T_vehicle);
  return poses;
}

std::vector<model::SubmapPose> MapUnits::metres(std::vector<model::SubmapPose> poses) const {
  for (model::SubmapPose& one : poses) one.map_T_submap = metres(one.map_T_submap);
  return poses;
}

std::vector<model::Submap> MapUnits::metres(std::vector<model::Submap> submaps) const {
  for (model::Submap& one : submaps) {
    one.map_T_submap = metres(one.map_T_submap);
    one.landmarks = metres(std::move(one.landmarks));
    one.keyframes = metres(std::move(one.keyframes));
  }
  return submaps;
}

}  // namespace understory::geoslam_mapper::smoothing
