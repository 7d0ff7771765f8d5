// Frames of a drive that see each other's stems, one after another: what all of them saw around
// one.
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

/// How frames are chained.
struct StemChainParameters {
  std::size_t reach = 8;  ///< Frames before and after one that its view takes in.
  double beyond_m = 3.0;  ///< The view reaches farther than the frame by this.
  double merge_m = 0.35;  ///< Stems of several frames nearer to each other are one.
  double side_tolerance_m = 0.25;
  double max_step_m = 20.0;       ///< Between frames of a chain.
  double least_log_ratio = 30.0;  ///< A link is likelier than chance by this (natural logarithm)...
  /// ... or by this, where the frame lies as the last motion goes on: there are far fewer such
  /// poses.
  double least_log_ratio_ahead = 18.0;
  double ahead_m = 1.5;  ///< As the last motion goes on, within this ...
  double ahead_rad = 0.3;
  std::size_t gap = 3;  ///< Links reach over frames that were not aligned, at most so many back.
};

/// The frames in the order of a drive. Each one is aligned with what the last ones saw, without
/// odometry; where that fails a new chain begins.
class StemChains {
 public:
  /// Without frames.
  StemChains(const StemChainParameters& parameters, const StemTriangleParameters& triangles,
             const StemNoise& noise)
      : parameters_(parameters), triangles_(triangles), noise_(noise) {}

  /// Adds the next frame.
  void add(const PackedStems& stems, const DiameterSpread& diameters);

  /// What frames before the index `end` saw around a frame, the frame among them. O(stems^2) of the
  /// frames in reach.
  StemView view(std::size_t frame, std::size_t end) const;
  /// Motion between two frames of one chain that are at most twice the reach apart.
  std::optional<geometry::SE2> between(std::size_t a, std::size_t b) const;

  /// Number of frames.
  std::size_t size() const { return frames_.size(); }
  /// Stems of a frame.
  const PackedStems& stems(std::size_t frame) const { return frames_[frame].stems; }
  /// How far frames beside one are taken in.
  std::size_t reach() const { return parameters_.reach; }

 private:
  struct Frame {
    PackedStems stems;
    float radius_m = 1.0F;
    std::uint32_t chain = 0;
    geometry::SE2 chain_T_frame;
    std::optional<geometry::SE2> step;  ///< The last motion, by a frame.
  };
  /// How a new frame lies to an earlier one; none where that is not sure.
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
