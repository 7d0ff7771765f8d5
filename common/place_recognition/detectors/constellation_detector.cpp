#include "common/place_recognition/detectors/constellation_detector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/place_recognition/landmark_pairs.hpp"

namespace understory::place_recognition::detectors {
namespace {

/// Landmarks of one frame: their ids are consecutive.
constexpr std::size_t kMostLandmarks = 4096;
/// 2 pi (1 - 1/golden ratio): each frame lies where the spiral has most room.
const double kGoldenAngleRad = std::numbers::pi * (3.0 - std::sqrt(5.0));

}  // namespace

/// Any two are more than two ranges and the greatest distance apart.
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

ScoredPlace ConstellationDetector::answered(const std::vector<LevelStem>& query,
                                            const constellation::Localisation& found,
                                            std::size_t frame) const {
  const LandmarkSets sets{query, frames_[frame].landmarks};
  PairedPose pose{{found.map_T_sensor.translation() - centre_m(frame), found.map_T_sensor.theta()},
                  {}};
  for (const constellation::PointAssociation& one : found.associations) {
    if (one.landmark_id / kMostLandmarks != frame) continue;
    pose.pairs.push_back(
        {one.observed, static_cast<std::uint32_t>(one.landmark_id % kMostLandmarks)});
  }
  const double sigma_m = std::sqrt(2.0) * parameters_.sigma_m;
  return {frames_[frame].id,
          -found.log10_false_alarm,
          {{pose.frame_T_query, paired_covariance(sets, pose, sigma_m)}}};
}

std::vector<ScoredPlace> ConstellationDetector::query(const PlaceFrame& frame,
                                                      const PlaceQuery& limits) const {
  std::size_t end = 0;
  while (end < frames_.size() && frames_[end].id <= limits.newest) ++end;
  const std::vector<LevelStem> landmarks = in_range(frame);
  if (end == 0 || limits.most == 0) return {};

  std::vector<constellation::ObservedPoint> points;
  points.reserve(landmarks.size());
  for (const LevelStem& landmark : landmarks)
    points.push_back({landmark.position_m, parameters_.sigma_m});
  constellation::LocaliseParameters parameters;
  parameters.map_sigma_m = parameters_.sigma_m;
  const constellation::Disc where{Eigen::Vector2d::Zero(),
                                  centre_m(end - 1).norm() + parameters_.max_distance_m};
  const constellation::Localisation found = map_.localise(points, parameters, where);
  if (found.associations.empty()) return {};

  const std::size_t at = found.associations.front().landmark_id / kMostLandmarks;
  if (at >= end) return {};
  ScoredPlace place = answered(landmarks, found, at);
  const geometry::SE2& pose = place.guesses.front().mean;
  if (pose.translation().norm() > parameters_.max_distance_m) return {};
  return {std::move(place)};
}

std::size_t ConstellationDetector::descriptor_bytes() const {
  std::size_t landmarks = 0;
  for (const Frame& frame : frames_) landmarks += frame.landmarks.size();
  return landmarks * sizeof(LevelStem);
}

}  // namespace understory::place_recognition::detectors
