#include "common/place_recognition/detectors/constellation_detector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/place_recognition/detectors/linear_detector.hpp"
#include "common/place_recognition/landmark_pairs.hpp"

namespace understory::place_recognition::detectors {
namespace {

/// Largest number of landmarks of one frame; their ids are consecutive.
constexpr std::size_t kMostLandmarks = 4096;
/// 2 pi (1 - 1/golden ratio): each frame is at the largest free space of the spiral.
const double kGoldenAngleRad = std::numbers::pi * (3.0 - std::sqrt(5.0));

std::vector<constellation::ObservedPoint> observed(
    const std::vector<LevelStem>& landmarks, const ConstellationDetectorParameters& parameters) {
  std::vector<constellation::ObservedPoint> points;
  points.reserve(landmarks.size());
  for (const LevelStem& landmark : landmarks)
    points.push_back({landmark.position_m, parameters.sigma_m});
  return points;
}

}  // namespace

/// The distance of any two frames is more than two ranges plus the greatest distance.
Eigen::Vector2d ConstellationDetector::centre_m(std::size_t frame) const {
  const double apart_m = 2.0 * parameters_.max_range_m + 2.0 * parameters_.max_distance_m;
  const double radius_m = apart_m * std::sqrt(static_cast<double>(frame) + 1.0);
  const double angle_rad = kGoldenAngleRad * static_cast<double>(frame);
  return {radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad)};
}

std::vector<LevelStem> ConstellationDetector::in_range(const PlaceFrame& frame) const {
  std::vector<LevelStem> landmarks = nearest_landmarks(level_stems(frame), kMostLandmarks);
  std::erase_if(landmarks, [&](const LevelStem& landmark) {
    return !(landmark.position_m.norm() <= parameters_.max_range_m);
  });
  return landmarks;
}

void ConstellationDetector::add(const PlaceFrame& frame) {
  const std::size_t index = frames_.size();
  const Eigen::Vector2d centre = centre_m(index);
  Frame kept{frame.id, in_range(frame)};
  for (std::size_t i = 0; i < kept.landmarks.size(); ++i)
    map_.insert(index * kMostLandmarks + i, centre + kept.landmarks[i].position_m);
  frames_.push_back(std::move(kept));
}

constellation::LocaliseParameters ConstellationDetector::search() const {
  constellation::LocaliseParameters parameters;
  parameters.map_sigma_m = parameters_.sigma_m;
  return parameters;
}

/// Localises the query in a map of one frame; none where nothing fits or the pose is too far away.
std::optional<ScoredPlace> ConstellationDetector::compared(const std::vector<LevelStem>& query,
                                                           std::size_t frame) const {
  constellation::ConstellationMap map;
  for (std::size_t i = 0; i < frames_[frame].landmarks.size(); ++i)
    map.insert(i, frames_[frame].landmarks[i].position_m);
  const constellation::Localisation found = map.localise(observed(query, parameters_), search());
  if (found.associations.empty()) return std::nullopt;
  if (found.map_T_sensor.translation().norm() > parameters_.max_distance_m) return std::nullopt;

  PairedPose pose{found.map_T_sensor, {}};
  for (const constellation::PointAssociation& one : found.associations)
    pose.pairs.push_back({one.observed, static_cast<std::uint32_t>(one.landmark_id)});
  const Eigen::Matrix3d covariance = paired_covariance({query, frames_[frame].landmarks}, pose,
                                                       std::sqrt(2.0) * parameters_.sigma_m);
  return ScoredPlace{
      frames_[frame].id, -found.log10_false_alarm, {{pose.frame_T_query, covariance}}};
}

std::vector<ScoredPlace> ConstellationDetector::query(const PlaceFrame& frame,
                                                      const PlaceQuery& limits) const {
  std::size_t end = 0;
  while (end < frames_.size() && frames_[end].id <= limits.newest) ++end;
  const std::vector<LevelStem> landmarks = in_range(frame);
  if (end == 0) return {};

  const constellation::Disc where{Eigen::Vector2d::Zero(),
                                  centre_m(end - 1).norm() + parameters_.max_distance_m};
  const constellation::Localisation found =
      map_.localise(observed(landmarks, parameters_), search(), where);
  if (found.associations.empty()) return {};

  const std::size_t at = found.associations.front().landmark_id / kMostLandmarks;
  std::vector<ScoredPlace> places;
  for (std::size_t i = at - std::min(at, parameters_.reach);
       i < std::min(end, at + parameters_.reach + 1); ++i) {
    if (auto place = compared(landmarks, i)) places.push_back(std::move(*place));
  }
  keep_best(places, limits.most);
  return places;
}

std::size_t ConstellationDetector::descriptor_bytes() const {
  std::size_t landmarks = 0;
  for (const Frame& frame : frames_) landmarks += frame.landmarks.size();
  return landmarks * sizeof(LevelStem);
}

}  // namespace understory::place_recognition::detectors
