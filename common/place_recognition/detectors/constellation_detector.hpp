// Place recognition by the one-shot search among identical landmarks, with all frames in one map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/constellation/map.hpp"
#include "common/place_recognition/detector_parameters.hpp"
#include "common/place_recognition/place_detector.hpp"

namespace understory::place_recognition::detectors {

/// All frames are in one map, each at its own position on a spiral, far from all others, so that
/// the frames up to a given one are within a disc. A query is localised in this map
/// (common/constellation): its best pose lies at one frame. This frame and those before and after
/// it are then searched separately, so that the nearest frames of a passage are found, not only the
/// first. The score is minus log10 of the bound on chance.
class ConstellationDetector final : public PlaceDetector {
 public:
  /// Precondition: sigma and ranges > 0.
  explicit ConstellationDetector(const ConstellationDetectorParameters& parameters)
      : parameters_(parameters) {}

  void add(const PlaceFrame& frame) override;
  std::vector<ScoredPlace> query(const PlaceFrame& frame, const PlaceQuery& limits) const override;
  std::size_t size() const override { return frames_.size(); }
  std::size_t descriptor_bytes() const override;

 private:
  struct Frame {
    FrameId id = 0;
    std::vector<LevelStem> landmarks;
  };
  Eigen::Vector2d centre_m(std::size_t frame) const;
  std::vector<LevelStem> in_range(const PlaceFrame& frame) const;
  constellation::LocaliseParameters search() const;
  std::optional<ScoredPlace> compared(const std::vector<LevelStem>& query, std::size_t frame) const;

  ConstellationDetectorParameters parameters_;
  std::vector<Frame> frames_;
  constellation::ConstellationMap map_;
};

}  // namespace understory::place_recognition::detectors
