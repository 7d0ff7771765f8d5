// Chains of a drive's frames with common stems: combines the stems that adjacent frames saw.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/level_stems.hpp"
#include "common/place_recognition/stem_likelihood.hpp"
#include "common/place_recognition/stem_triangles.hpp"

namespace understory::place_recognition {

/// Parameters of chaining frames.
struct StemChainParameters {
  std::size_t reach = 8;  ///< Frames before and after one that its view includes.
  double beyond_m = 3.0;  ///< The view extends beyond the frame by this.
  double merge_m = 0.35;  ///< Stems of several frames nearer than this are one.
  double side_tolerance_m = 0.25;
  double max_step_m = 20.0;  ///< Largest step between frames of a chain.
  /// Least log likelihood ratio of a link against chance (natural logarithm) ...
  double least_log_ratio = 30.0;
  /// ... or this, if the pose continues the last motion, because there are far fewer such poses.
  double least_log_ratio_ahead = 18.0;
  double ahead_m = 1.5;  ///< Largest difference from the continued last motion ...
  double ahead_rad = 0.3;
  std::size_t gap = 3;  ///< Links may skip frames that were not aligned, at most this many.
};

/// The frames in the order of a drive. Each one is aligned with the stems of the last ones, without
/// odometry; if this fails a new chain begins.
class StemChains {
 public:
  /// Starts without frames.
  StemChains(const StemChainParameters& parameters, const StemTriangleParameters& triangles,
             const StemNoise& noise)
      : parameters_(parameters), triangles_(triangles), noise_(noise) {}

  /// Adds the next frame.
  void add(const PackedStems& stems, const DiameterSpread& diameters);

  /// Stems around a frame from it and its neighbours before the index `end`. O(stems^2) of the
  /// frames in reach.
  StemView view(std::size_t frame, std::size_t end) const;
  /// Motion between two frames of one chain at most twice the reach apart.
  std::optional<geometry::SE2> between(std::size_t a, std::size_t b) const;

  /// Number of frames.
  std::size_t size() const { return frames_.size(); }
  /// Stems of a frame.
  const PackedStems& stems(std::size_t frame) const { return frames_[frame].stems; }
  /// Number of frames included on each side.
  std::size_t reach() const { return parameters_.reach; }

 private:
  struct Frame {
    PackedStems stems;
    float radius_m = 1.0F;
    std::uint32_t chain = 0;
    geometry::SE2 chain_T_frame;
    std::optional<geometry::SE2> step;  ///< The last motion, per frame.
  };
  /// Pose of a new frame relative to an earlier one; none where it is not certain.
  std::optional<geometry::SE2> aligned(std::span<const LevelStem> stems, std::size_t earlier,
                                       const DiameterSpread& diameters) const;
  double needed_log_ratio(const geometry::SE2& pose,
                          const std::optional<geometry::SE2>& expected) const;

  StemChainParameters parameters_;
  StemTriangleParameters triangles_;
  StemNoise noise_;
  std::vector<Frame> frames_;
  std::uint32_t chains_ = 0;
};

}  // namespace understory::place_recognition
