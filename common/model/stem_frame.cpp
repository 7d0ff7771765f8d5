#include "common/model/stem_frame.hpp"

#include <cmath>

namespace understory::model {
namespace {

/// If x points straight up or down it has no heading; the heading then follows from y.
double heading_of(const Eigen::Matrix3d& world_R_sensor) {
  const Eigen::Vector2d x = world_R_sensor.col(0).head<2>();
  if (x.norm() > 1e-6) return std::atan2(x.y(), x.x());
  return std::atan2(-world_R_sensor(0, 1), world_R_sensor(1, 1));
}

}  // namespace

geometry::SE2 level_pose(const StemFrame& frame) {
  return {frame.world_T_sensor.translation().head<2>(), heading_of(frame.world_T_sensor.linear())};
}

Eigen::Matrix3d level_R_sensor(const StemFrame& frame) {
  const Eigen::Matrix3d world_R_sensor = frame.world_T_sensor.linear();
  const Eigen::AngleAxisd back(-heading_of(world_R_sensor), Eigen::Vector3d::UnitZ());
  return back.toRotationMatrix() * world_R_sensor;
}

LandmarkScan level_scan(const StemFrame& frame, double sigma_m, double max_range_m) {
  LandmarkScan scan;
  scan.utime = frame.utime;
  scan.field_of_view.max_range_m = max_range_m;
  scan.detections.reserve(frame.stems.size());
  const Eigen::Matrix3d rotation = level_R_sensor(frame);

  for (const Stem& stem : frame.stems) {
    Detection detection;
    detection.position_m = rotation * stem.position_m;
    detection.covariance_m2 = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
    detection.radius_m = 0.5 * stem.diameter_m;
    scan.detections.push_back(detection);
  }

  return scan;
}

}  // namespace understory::model
