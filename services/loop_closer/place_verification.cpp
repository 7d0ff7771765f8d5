#include "services/loop_closer/place_verification.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
namespace understory::loop_closer {
namespace {

using place_recognition::PlaceFrame;
using place_recognition::ScoredPlace;

constexpr const char* kGraph = "correspondence_graph";
/// Two who look at the same landmarks agree on the pose so well [m], [rad] ...
constexpr double kAgreeM = 0.3;
constexpr double kAgreeRad = 0.03;
/// Two candidates that put the query so far apart [m], [rad] are rivals: farther than odometry is
/// off between places that show one another.
constexpr double kElsewhereM = 3.0;
constexpr double kElsewhereRad = 0.2;

bool are_near(const geometry::SE2& a, const geometry::SE2& b, double near_m, double near_rad) {
  const geometry::SE2 off = a.inverse() * b;
  return off.translation().norm() <= near_m && std::abs(off.theta()) <= near_rad;
}

/// Where a found place puts the query, frame `map`.
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

PlaceFrame frame_of(std::uint64_t keyframe, std::span<const LevelStem> stems) {
  PlaceFrame frame;
  frame.id = static_cast<place_recognition::FrameId>(keyframe);
  frame.landmarks.reserve(stems.size());
  for (const LevelStem& stem : stems)
    frame.landmarks.push_back({{stem.position_m.x(), stem.position_m.y(), 0.0}, stem.diameter_m});
  return frame;
}

PlaceVerification::PlaceVerification(const SearchParameters& search, bool has_evidence,
                                     const place_recognition::VerifierParameters& parameters)
    : candidates_(has_evidence ? 1 : static_cast<std::size_t>(search.candidates)),
      least_pairs_(static_cast<std::size_t>(search.verified_pairs)),
      verifier_(place_recognition::make_verifier(search.verifier, parameters)) {
  if (!has_evidence && search.verifier != kGraph)
    second_ = place_recognition::make_verifier(kGraph, parameters);
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

std::optional<FoundPlace> PlaceVerification::compared(const PlaceFrame& query,
                                                      const ScoredPlace& scored,
                                                      const Place& place) const {
  const PlaceFrame frame = frame_of(place.keyframe, place.stems);
  const auto one = verifier_->verify(query, frame, scored.guesses);
  if (!one || one->inliers < least_pairs_) return std::nullopt;
  if (scored.evidence) {
    const geometry::SE2WithCovariance& found = scored.guesses.front();
    if (!are_near(found.mean, one->frame_T_query, kAgreeM, kAgreeRad)) return std::nullopt;
    return FoundPlace{place.keyframe, found, scored.evidence->pairs, 0, scored.evidence};
  }

  std::size_t pairs = one->inliers;
  if (second_) {
    const auto other = second_->verify(query, frame, scored.guesses);
    if (!other || other->inliers < least_pairs_ ||
        !are_near(other->frame_T_query, one->frame_T_query, kAgreeM, kAgreeRad))
      return std::nullopt;
    pairs = std::min(pairs, other->inliers);
  }
  return FoundPlace{place.keyframe, {one->frame_T_query, one->covariance}, pairs};
}

}  // namespace understory::loop_closer
