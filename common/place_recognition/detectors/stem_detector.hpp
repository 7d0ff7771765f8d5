// The recogniser of stems with the interface of all detectors.
#pragma once

#include "common/place_recognition/place_detector.hpp"
#include "common/place_recognition/stem_recogniser.hpp"

namespace understory::place_recognition::detectors {

/// StemRecogniser (docs/decisions/100). The first candidate is its answer; its score is the number
/// of decades of place_recognition::decades_of(). The others have scores from their own bounds on
/// chance, limited to the first one's.
class StemDetector final : public PlaceDetector {
 public:
  /// Without frames.
  explicit StemDetector(const StemRecogniserParameters& parameters)
      : radius_m_(parameters.radius_m), recogniser_(parameters) {}

  void add(const PlaceFrame& frame) override { recogniser_.add(frame.id, level_stems(frame)); }
  std::vector<ScoredPlace> query(const PlaceFrame& frame, const PlaceQuery& limits) const override;
  std::size_t size() const override { return recogniser_.size(); }
  std::size_t descriptor_bytes() const override { return recogniser_.stored_bytes(); }

 private:
  double radius_m_;
  StemRecogniser recogniser_;
};

}  // namespace understory::place_recognition::detectors
