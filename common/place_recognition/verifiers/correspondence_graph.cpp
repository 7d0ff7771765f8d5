#include "common/place_recognition/verifiers/correspondence_graph.hpp"

#include <algorithm>
#include <cmath>

namespace understory::place_recognition::verifiers {
namespace {

constexpr std::size_t kLeastPairs = 3;

bool diameters_agree(const LevelStem& a, const LevelStem& b, double log_tolerance) {
  if (!(a.diameter_m > 0.0) || !(b.diameter_m > 0.0)) return true;
  return std::abs(std::log(a.diameter_m / b.diameter_m)) <= log_tolerance;
}

double apart_m(std::span<const LevelStem> landmarks, std::uint32_t a, std::uint32_t b) {
  return (landmarks[a].position_m - landmarks[b].position_m).norm();
}

}  // namespace

CorrespondenceGraph correspondence_graph(const LandmarkSets& landmarks,
                                         const CorrespondenceGraphParameters& parameters) {
  CorrespondenceGraph result;
  for (std::uint32_t i = 0; i < landmarks.query.size(); ++i) {
    for (std::uint32_t j = 0; j < landmarks.frame.size(); ++j) {
      if (diameters_agree(landmarks.query[i], landmarks.frame[j],
                          parameters.diameter_log_tolerance))
        result.pairs.push_back({i, j});
    }
  }

  result.graph = VertexGraph(result.pairs.size());
  for (std::size_t a = 0; a < result.pairs.size(); ++a) {
    for (std::size_t b = a + 1; b < result.pairs.size(); ++b) {
      const LandmarkPair& one = result.pairs[a];
      const LandmarkPair& other = result.pairs[b];
      if (one.query == other.query || one.frame == other.frame) continue;
      const double of_query = apart_m(landmarks.query, one.query, other.query);
      const double of_frame = apart_m(landmarks.frame, one.frame, other.frame);
      if (std::abs(of_query - of_frame) <= parameters.tolerance_m) result.graph.connect(a, b);
    }
  }
  return result;
}

std::optional<VerifiedPlace> place_by_pairs(const LandmarkSets& landmarks, const PairedPose& pose,
                                            const VerifierParameters& parameters) {
  if (pose.pairs.size() < kLeastPairs) return std::nullopt;
  if (!(pose.frame_T_query.translation().norm() <= parameters.max_distance_m)) return std::nullopt;
  return VerifiedPlace{pose.frame_T_query, paired_covariance(landmarks, pose, parameters.sigma_m),
                       static_cast<double>(pose.pairs.size()), pose.pairs.size()};
}

std::optional<VerifiedPlace> CorrespondenceGraphVerifier::verify(
    const PlaceFrame& query, const PlaceFrame& frame,
    std::span<const geometry::SE2WithCovariance> /*guesses*/) const {
  const auto& parameters = parameters_.graph;
  const auto of_query = nearest_landmarks(level_stems(query), parameters.most_landmarks);
  const auto of_frame = nearest_landmarks(level_stems(frame), parameters.most_landmarks);
  const LandmarkSets landmarks{of_query, of_frame};
  if (of_query.size() < kLeastPairs || of_frame.size() < kLeastPairs) return std::nullopt;

  const CorrespondenceGraph graph = correspondence_graph(landmarks, parameters);
  const Clique clique = max_clique(graph.graph, parameters.most_branches);
  std::vector<LandmarkPair> pairs;
  pairs.reserve(clique.vertices.size());
  for (const std::uint32_t vertex : clique.vertices) pairs.push_back(graph.pairs[vertex]);
  const auto agreed = most_agreed(landmarks, pairs, parameters.tolerance_m);
  return agreed ? place_by_pairs(landmarks, *agreed, parameters_) : std::nullopt;
}

}  // namespace understory::place_recognition::verifiers
