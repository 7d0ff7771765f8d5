// All policies and methods on one drive.
#pragma once

#include <vector>

#include "eval/experiments/partition/policy_run.hpp"
#include "eval/experiments/partition/scoring.hpp"

namespace understory::eval::experiments::partition {

/// What is compared on a drive.
struct ComparisonOptions {
  std::vector<Policy> policies;
  bool is_closed = false;     ///< The baseline gets a manual closure by the truth (§5.2, §5.4).
  bool all_designs = false;   ///< Every variant of the baseline, not the thesis's own alone.
  double largest_m = 1000.0;  ///< Stretches that are longer are left out of the mapper's rows.
};

/// The outcomes, "truth" and "uncut" first. Methods: "baseline" as the thesis has it, and with all
/// designs "baseline-condensed" (the condensed graph, also on an open route), "baseline-unscented",
/// "baseline-joint", "baseline-joint-all" (all that two submaps share) and "baseline-full";
/// "smoothing-condensed" is the mapper at the end of the drive, "smoothing" the same after its
/// stretches were put together again. Throws where the uncut drive has no solution.
std::vector<Outcome> compare(const RecordedDrive& drive,
                             const geoslam_mapper::SmoothingMapperParameters& parameters,
                             const ComparisonOptions& options);

}  // namespace understory::eval::experiments::partition
