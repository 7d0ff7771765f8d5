#include "common/place_recognition/place_frame.hpp"

namespace understory::place_recognition {

std::vector<LevelStem> level_stems(const PlaceFrame& frame) {
  std::vector<LevelStem> stems;
  stems.reserve(frame.landmarks.size());
  for (const PlaceLandmark& landmark : frame.landmarks) {
    if (!landmark.position_m.allFinite()) continue;
    stems.push_back({landmark.position_m.head<2>(), landmark.diameter_m});
  }
  return stems;
}

std::vector<Eigen::Vector3f> points_of(const PlaceFrame& frame) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(frame.cloud.size() + frame.landmarks.size());
  for (const Eigen::Vector3f& point : frame.cloud) {
    if (point.allFinite()) points.push_back(point);
  }
  if (!frame.cloud.empty()) return points;

  for (const PlaceLandmark& landmark : frame.landmarks) {
    if (landmark.position_m.allFinite()) points.push_back(landmark.position_m.cast<float>());
  }
  return points;
}

}  // namespace understory::place_recognition
