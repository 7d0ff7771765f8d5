#include "common/place_recognition/detectors/stem_detector.hpp"

#include <algorithm>

#include "common/place_recognition/detectors/linear_detector.hpp"
#include "common/place_recognition/place_confidence.hpp"

namespace understory::place_recognition::detectors {

std::vector<ScoredPlace> StemDetector::query(const PlaceFrame& frame,
                                             const PlaceQuery& limits) const {
  const PlaceAnswer answer = recogniser_.query(level_stems(frame), limits.newest);
  const PlaceCandidate* best = answer.best();
  if (best == nullptr) return {};

  const double decades = decades_of(answer, radius_m_);
  std::vector<ScoredPlace> places;
  places.reserve(answer.candidates.size());
  for (const PlaceCandidate& candidate : answer.candidates) {
    const double below = std::min(decades - 1e-6, -candidate.log10_false_alarm);
    places.push_back(
        {candidate.frame,
         &candidate == best ? decades : below,
         {{candidate.frame_T_query, candidate.covariance}},
         PlaceEvidence{candidate.log_ratio, candidate.pairs.size(), answer.log10_margin}});
  }
  keep_best(places, limits.most);
  return places;
}

}  // namespace understory::place_recognition::detectors
