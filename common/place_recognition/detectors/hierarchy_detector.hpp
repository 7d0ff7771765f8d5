// Place recognition by polygons of landmarks: the geometric hierarchy of thesis 000.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/hierarchy/descriptor_index.hpp"
#include "common/place_recognition/detector_parameters.hpp"
#include "common/place_recognition/place_detector.hpp"

namespace understory::place_recognition::detectors {

/// Landmarks -> Delaunay triangles -> Urquhart polygons -> descriptors (thesis 000 §3.2). Each
/// polygon of a query votes for every frame with a polygon within tau, with weight 1 - distance /
/// tau. In the frames with most votes landmarks are matched through the polygons
/// (hierarchy::match), and the score is the number of matches that agree on one motion, plus votes
/// / (1 + votes). That motion is the guess.
class HierarchyDetector final : public PlaceDetector {
 public:
  /// `sigma_m`: standard deviation per axis of the difference of a landmark's positions.
  HierarchyDetector(const HierarchyDetectorParameters& parameters, double sigma_m);

  void add(const PlaceFrame& frame) override;
  std::vector<ScoredPlace> query(const PlaceFrame& frame, const PlaceQuery& limits) const override;
  std::size_t size() const override { return frames_.size(); }
  std::size_t descriptor_bytes() const override;

  /// Votes of a frame's polygons for the frames before the index `end`.
  std::vector<double> votes(const PlaceFrame& frame, std::size_t end) const;

 private:
  struct Frame {
    FrameId id = 0;
    std::vector<LevelStem> landmarks;
  };
  ScoredPlace compared(const PlaceFrame& query, std::size_t frame, double votes) const;

  HierarchyDetectorParameters parameters_;
  double sigma_m_;
  std::vector<Frame> frames_;
  hierarchy::DescriptorIndex polygons_;
  std::vector<std::uint32_t> frame_of_polygon_;  ///< Frame by key in the index.
};

}  // namespace understory::place_recognition::detectors
