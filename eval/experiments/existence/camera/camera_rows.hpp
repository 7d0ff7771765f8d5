// Rows of the result document: what culling is worth, and when mapping is needed.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "eval/experiments/existence/camera/camera_run.hpp"

namespace understory::eval::experiments::existence::camera {

/// 95 % interval of a share, in percent (Wilson 1927).
struct Interval {
  double low = 0.0;
  double high = 0.0;
};
Interval wilson_pct(std::size_t hits, std::size_t all);

/// A row per method: all runs of one world and share of change together. `runs` must not be empty;
/// the first method is the one that removes nothing. An ablation's row has its points alone.
nlohmann::json culling_rows(const std::vector<const CaseResult*>& runs,
                            const std::vector<CameraMethod>& methods);

/// Areas under the ROC of each signal: drives through worlds changed by at least 20 %, and by each
/// share, against unchanged ones; first drives after the change, and all.
nlohmann::json mapping_needed_rows(const std::vector<CaseResult>& cases);
/// The curves for the plot: changed by 20 % and more, and by less, first drives.
nlohmann::json mapping_needed_curves(const std::vector<CaseResult>& cases);

}  // namespace understory::eval::experiments::existence::camera
