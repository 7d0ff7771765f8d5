// Parameters of the existence tracker. Meaning, range and default of each are documented once: in
// adapter_parameters.cpp, which `understory-existence-tracker --help` prints. The comments here
// give units that are not in the name.
#pragma once

#include "common/existence/parameters.hpp"

namespace understory::existence_tracker {

/// The model's parameters for maps that are used for years: an initial rate of disappearance (half
/// of the landmarks in a year), soon replaced by the estimate. With a rate of zero, a landmark once
/// seen well would exist for ever.
constexpr existence::Parameters for_maps() {
  existence::Parameters parameters;
  parameters.decay_per_s = 2e-8;
  parameters.decay_weight = 2.0;
  return parameters;
}

/// When a landmark leaves use, and when it returns.
struct UseParameters {
  double drop_below = 0.1;     ///< Probability.
  double readmit_above = 0.5;  ///< Probability.
};

/// Limits of a pass, and which looks count.
struct LookParameters {
  double pass_s = 14400.0;
  double pass_m = 500.0;      ///< Path.
  double same_pass_m = 50.0;  ///< Path.
  int min_inliers = 3;
  bool use_ranges = true;
};

/// When the map is no longer sufficient for localisation.
struct NeedParameters {
  double window_m = 60.0;  ///< Path.
  int min_landmarks = 10;
  double changed_above = 0.3;  ///< Sum of two shares.
};

/// What is published, and how often.
struct OutputParameters {
  double told_change = 0.02;  ///< Probability.
  int repeated = 20;          ///< Landmarks per message.
  double state_period_s = 30.0;
};

/// The stage's parameters.
struct TrackerParameters {
  existence::Parameters model = for_maps();
  UseParameters use;
  LookParameters looks;
  NeedParameters need;
  OutputParameters output;
};

}  // namespace understory::existence_tracker
