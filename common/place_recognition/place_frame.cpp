#include "common/place_recognition/place_frame.hpp"

namespace understory::place_recognition {
namespace {

/// Written so that NaN fails.
bool counts(const Eigen::Vector3d& at) {
  return at.cwiseAbs().maxCoeff() <= kMostDistantM && at.allFinite();
}

}  // namespace

std::vector<PlaceLandmark> landmarks_of(const PlaceFrame& frame) {
  std::vector<PlaceLandmark> landmarks;
  landmarks.reserve(frame.landmarks.size());
  for (const PlaceLandmark& landmark : frame.landmarks) {
    if (counts(landmark.position_m)) landmarks.push_back(landmark);
  }
  return landmarks;
}

std::vector<LevelStem> level_stems(const PlaceFrame& frame) {
  std::vector<LevelStem> stems;
  stems.reserve(frame.landmarks.size());
  for (const PlaceLandmark& landmark : landmarks_of(frame))
    stems.push_back({landmark.position_m.head<2>(), landmark.diameter_m});
  return stems;
}

std::vector<Eigen::Vector3f> points_of(const PlaceFrame& frame) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(frame.cloud.size() + frame.landmarks.size());
  for (const Eigen::Vector3f& point : frame.cloud) {
    if (counts(point.cast<double>())) points.push_back(point);
  }
  if (!frame.cloud.empty()) return points;

  for (const PlaceLandmark& landmark : landmarks_of(frame))
    points.emplace_back(landmark.position_m.cast<float>());
  return points;
}

}  // namespace understory::place_recognition
