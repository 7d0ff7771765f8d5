#include "common/place_recognition/detectors/hierarchy_detector.hpp"

#include <algorithm>
#include <utility>

#include "common/hierarchy/geometric_hierarchy.hpp"
#include "common/hierarchy/matching.hpp"
#include "common/place_recognition/detectors/linear_detector.hpp"
#include "common/place_recognition/landmark_pairs.hpp"

namespace understory::place_recognition::detectors {
namespace {

/// A hierarchy whose ids are the indices of the landmarks.
hierarchy::GeometricHierarchy hierarchy_of(const std::vector<LevelStem>& landmarks,
                                           double max_distance) {
  std::vector<hierarchy::LandmarkPosition> positions;
  positions.reserve(landmarks.size());
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    positions.push_back({i, landmarks[i].position_m});
  hierarchy::HierarchyParameters parameters;
  parameters.max_descriptor_distance = max_distance;
  return hierarchy::GeometricHierarchy(positions, parameters);
}

}  // namespace

HierarchyDetector::HierarchyDetector(const HierarchyDetectorParameters& parameters, double sigma_m)
    : parameters_(parameters),
      sigma_m_(sigma_m),
      polygons_(static_cast<float>(parameters.max_descriptor_distance)) {}

void HierarchyDetector::add(const PlaceFrame& frame) {
  std::vector<LevelStem> landmarks = level_stems(frame);
  const auto hierarchy = hierarchy_of(landmarks, parameters_.max_descriptor_distance);
  for (const hierarchy::Polygon& polygon : hierarchy.polygons()) {
    if (!polygon.exists()) continue;
    polygons_.insert(static_cast<std::uint32_t>(frame_of_polygon_.size()), polygon.descriptor);
    frame_of_polygon_.push_back(static_cast<std::uint32_t>(frames_.size()));
  }
  frames_.push_back({frame.id, std::move(landmarks)});
}

std::vector<double> HierarchyDetector::votes(const PlaceFrame& frame, std::size_t end) const {
  const auto query = hierarchy_of(level_stems(frame), parameters_.max_descriptor_distance);
  const auto tau = static_cast<float>(parameters_.max_descriptor_distance);
  std::vector<double> votes(end, 0.0);
  std::vector<double> nearest(end);
  std::vector<hierarchy::DescriptorIndex::Hit> hits;
  for (const hierarchy::Polygon& polygon : query.polygons()) {
    if (!polygon.exists()) continue;
    polygons_.within(polygon.descriptor, tau, hits);
    // Only a frame's nearest polygon counts.
    std::fill(nearest.begin(), nearest.end(), 0.0);
    for (const auto& hit : hits) {
      const std::size_t voted = frame_of_polygon_[hit.key];
      if (voted >= end) continue;
      nearest[voted] = std::max(nearest[voted], 1.0 - static_cast<double>(hit.distance / tau));
    }
    for (std::size_t i = 0; i < end; ++i) votes[i] += nearest[i];
  }
  return votes;
}

ScoredPlace HierarchyDetector::compared(const PlaceFrame& query, std::size_t frame,
                                        double votes) const {
  const std::vector<LevelStem> landmarks = level_stems(query);
  const LandmarkSets sets{landmarks, frames_[frame].landmarks};
  hierarchy::MatchParameters parameters;
  parameters.max_descriptor_distance = parameters_.max_descriptor_distance;
  std::vector<LandmarkPair> pairs;
  for (const hierarchy::LandmarkMatch& match :
       hierarchy::match(hierarchy_of(landmarks, parameters_.max_descriptor_distance),
                        hierarchy_of(frames_[frame].landmarks, parameters_.max_descriptor_distance),
                        parameters)) {
    pairs.push_back(
        {static_cast<std::uint32_t>(match.query_id), static_cast<std::uint32_t>(match.map_id)});
  }

  ScoredPlace place{frames_[frame].id, votes / (1.0 + votes), {}};
  const auto agreed = most_agreed(sets, pairs, parameters_.gate_m);
  if (!agreed) return place;
  // By the likeliest motion the frame is not at the query's place.
  if (agreed->frame_T_query.translation().norm() > parameters_.max_distance_m) return place;
  place.score += static_cast<double>(agreed->pairs.size());
  place.guesses.push_back({agreed->frame_T_query, paired_covariance(sets, *agreed, sigma_m_)});
  return place;
}

std::vector<ScoredPlace> HierarchyDetector::query(const PlaceFrame& frame,
                                                  const PlaceQuery& limits) const {
  std::size_t end = 0;
  while (end < frames_.size() && frames_[end].id <= limits.newest) ++end;
  const std::vector<double> voted = votes(frame, end);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < end; ++i) {
    if (voted[i] > 0.0) order.emplace_back(-voted[i], i);
  }
  std::sort(order.begin(), order.end());
  if (order.size() > parameters_.most_frames) order.resize(parameters_.most_frames);

  std::vector<ScoredPlace> places;
  places.reserve(order.size());
  for (const auto& [votes, i] : order) places.push_back(compared(frame, i, -votes));
  keep_best(places, limits.most);
  return places;
}

std::size_t HierarchyDetector::descriptor_bytes() const {
  std::size_t bytes =
      frame_of_polygon_.size() * (sizeof(hierarchy::Descriptor) + sizeof(std::uint32_t));
  for (const Frame& frame : frames_) bytes += frame.landmarks.size() * sizeof(LevelStem);
  return bytes;
}

}  // namespace understory::place_recognition::detectors
