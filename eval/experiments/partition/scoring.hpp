// Trajectories against each other and against the truth, at the cuts and between them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "eval/experiments/partition/policies.hpp"
#include "eval/metrics/victoria_park_score.hpp"

namespace understory::eval::experiments::partition {

/// A trajectory by time, first pose held.
using Trajectory = std::vector<metrics::StampedPose>;

/// RMS distances [m]; 0 where there are no such keyframes.
struct Distances {
  double all_m = 0.0;
  double at_cuts_m = 0.0;  ///< Of the keyframes at the cuts.
  double between_m = 0.0;  ///< Of the others.
};
/// Between the poses of the same times.
Distances distances(const Trajectory& a, const Trajectory& b, std::span<const model::Utime> cuts);

/// What a cut did to the motion across it.
struct CutEffect {
  double landmarks = 0.0;  ///< Mean over the last 16 scans before it.
  double step_m = 0.0;     ///< Motion across it, cut against uncut.
  double step_mrad = 0.0;  ///< Likewise, of the heading.
};
/// Of each cut with kAround keyframes before and behind it; `landmarks` is of each cut.
std::vector<CutEffect> effects(const Trajectory& cut, const Trajectory& uncut,
                               std::span<const model::Utime> cuts,
                               std::span<const double> landmarks);
/// Keyframes on either side of a cut over which its effect is measured.
constexpr std::size_t kAround = 8;

/// One method with one policy on one drive.
struct Outcome {
  std::string method;  ///< "baseline", "smoothing" and variants of them.
  Policy policy;
  std::string failure;  ///< Why there is no solution; empty where there is one.
  Distances to_uncut;
  Distances to_reference;
  Distances uncut_to_reference;  ///< The uncut solution at the same keyframes.
  double length_m = 0.0;
  std::size_t submaps = 1;
  double partition_ms = 0.0;
  double iteration_ms = 0.0;
  double closure_s = 0.0;
  double resident_mb = 0.0;
  double stored_bytes = 0.0;
  double mean_nees = 0.0;  ///< 0 where there is none.
  std::size_t refused = 0;
  std::vector<CutEffect> effects;
  Trajectory trajectory;
  std::vector<model::Utime> cuts;
};

}  // namespace understory::eval::experiments::partition
