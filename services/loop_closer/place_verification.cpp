#include "services/loop_closer/place_verification.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "services/loop_closer/expectation.hpp"

namespace understory::loop_closer {
namespace {

using place_recognition::PlaceFrame;
using place_recognition::ScoredPlace;

constexpr const char* kGraph = "correspondence_graph";
/// Two results from the same landmarks agree if their poses differ by less than this [m], [rad] ...
constexpr double kAgreeM = 0.3;
constexpr double kAgreeRad = 0.03;
/// ... or, if one of them leaves a direction undetermined, by less than this squared Mahalanobis
/// distance: 99.9 % of three degrees of freedom.
constexpr double kAgreeChi2 = 16.27;
/// Two candidates whose poses of the query differ by more than this [m], [rad] are rivals: more
/// than odometry's error between places in view of each other.
constexpr double kElsewhereM = 3.0;
constexpr double kElsewhereRad = 0.2;

bool are_near(const geometry::SE2& a, const geometry::SE2& b, double near_m, double near_rad) {
  const geometry::SE2 off = a.inverse() * b;
  return off.translation().norm() <= near_m && std::abs(off.theta()) <= near_rad;
}

/// Whether two results agree, given their covariances.
bool agree(const geometry::SE2WithCovariance& a, const geometry::SE2WithCovariance& b) {
  return are_near(a.mean, b.mean, kAgreeM, kAgreeRad) || squared_distance(a, b) <= kAgreeChi2;
}

geometry::SE2WithCovariance pose_of(const place_recognition::VerifiedPlace& verified) {
  return {verified.frame_T_query, verified.covariance};
}

/// Pose of the query by a found place, frame `map`.
geometry::SE2 puts_at(const FoundPlace& one, const PlaceMemory& memory) {
  return memory.of_keyframe(one.keyframe)->map_T_base.mean * one.place_T_query.mean;
}

void note_rivals(std::vector<FoundPlace>& found, const PlaceMemory& memory) {
  for (FoundPlace& one : found) {
    const geometry::SE2 here = puts_at(one, memory);
    for (const FoundPlace& other : found) {
      if (!are_near(here, puts_at(other, memory), kElsewhereM, kElsewhereRad))
        one.rival_pairs = std::max(one.rival_pairs, other.pairs);
    }
  }
}

}  // namespace

PlaceFrame frame_of(const Place& place) {
  PlaceFrame frame;
  frame.id = static_cast<place_recognition::FrameId>(place.keyframe);
  frame.landmarks.reserve(place.stems.size());
  for (const LevelStem& stem : place.stems)
    frame.landmarks.push_back({{stem.position_m.x(), stem.position_m.y(), 0.0}, stem.diameter_m});
  frame.cloud.reserve(place.cloud.size());
  for (const model::PlacePoint& point : place.cloud) frame.cloud.push_back(point.position_m());
  return frame;
}

PlaceVerification::PlaceVerification(const SearchParameters& search, bool has_evidence,
                                     const place_recognition::VerifierParameters& parameters)
    : candidates_(has_evidence ? 1 : static_cast<std::size_t>(search.candidates)),
      least_pairs_(static_cast<std::size_t>(search.verified_pairs)),
      verifier_(place_recognition::make_verifier(search.verifier, parameters)) {
  if (place_recognition::verifier_wants_cloud(search.verifier))
    least_score_ = search.verified_score;
  if (!has_evidence && search.verifier != kGraph)
    graph_ = place_recognition::make_verifier(kGraph, parameters);
}

std::vector<FoundPlace> PlaceVerification::verified(const PlaceFrame& query,
                                                    std::span<const ScoredPlace> scored,
                                                    const PlaceMemory& memory) const {
  std::vector<FoundPlace> found;
  for (const ScoredPlace& one : scored) {
    const Place* const place = memory.of_keyframe(static_cast<std::uint64_t>(one.frame));
    if (place == nullptr) continue;
    if (auto compared_place = compared(query, one, *place)) found.push_back(*compared_place);
  }
  note_rivals(found, memory);
  std::ranges::stable_sort(found, std::greater{}, &FoundPlace::pairs);
  return found;
}

/// Points of a cloud are no landmarks: the share of them with a partner is compared.
bool PlaceVerification::is_enough(const place_recognition::VerifiedPlace& verified) const {
  return least_score_ ? verified.score >= *least_score_ : verified.inliers >= least_pairs_;
}

std::optional<FoundPlace> PlaceVerification::compared(const PlaceFrame& query,
                                                      const ScoredPlace& scored,
                                                      const Place& place) const {
  const PlaceFrame frame = frame_of(place);
  if (scored.evidence) {
    const geometry::SE2WithCovariance& found = scored.guesses.front();
    const auto one = verifier_->verify(query, frame, scored.guesses);
    if (!one || !is_enough(*one) || !agree(found, pose_of(*one))) return std::nullopt;
    return FoundPlace{place.keyframe, found, scored.evidence->pairs, 0, scored.evidence};
  }
  if (!graph_) {
    const auto one = verifier_->verify(query, frame, scored.guesses);
    if (!one || !is_enough(*one)) return std::nullopt;
    return FoundPlace{place.keyframe, pose_of(*one), one->inliers};
  }

  // The comparison of clouds starts at the pose by the landmarks: its search is local.
  const auto graph = graph_->verify(query, frame, scored.guesses);
  if (!graph || graph->inliers < least_pairs_) return std::nullopt;
  const std::vector by_graph{pose_of(*graph)};
  const auto one = verifier_->verify(query, frame, least_score_ ? by_graph : scored.guesses);
  if (!one || !is_enough(*one) || !agree(by_graph.front(), pose_of(*one))) return std::nullopt;
  if (least_score_) return FoundPlace{place.keyframe, by_graph.front(), graph->inliers};
  return FoundPlace{place.keyframe, pose_of(*one), std::min(one->inliers, graph->inliers)};
}

}  // namespace understory::loop_closer
