// Parameters of the existence tracker. What each one does, with range and default, is documented
// once: in adapter_parameters.cpp, which `understory-existence-tracker --help` prints. Here stand
// the units that a name does not give.
#pragma once

#include "common/existence/parameters.hpp"

namespace understory::existence_tracker {

/// The model's parameters for landmarks of maps that are driven in again: a rate at which things go
/// (half of them in a year) that is soon learned. With none, what was once seen well exists for
/// ever.
constexpr existence::Parameters for_maps() {
  existence::Parameters parameters;
  parameters.decay_per_s = 2e-8;
  parameters.decay_weight = 2.0;
  return parameters;
}

/// When a landmark is not used any more, and when it is again.
struct UseParameters {
  double drop_below = 0.1;     ///< Probability.
  double readmit_above = 0.5;  ///< Probability.
};

/// What is one pass, and which looks count.
struct LookParameters {
  double pass_s = 14400.0;
  double pass_m = 500.0;      ///< Path.
  double same_pass_m = 50.0;  ///< Path.
  int min_inliers = 3;
  bool use_ranges = true;
};

/// When the map does not tell any more where the vehicle is.
struct NeedParameters {
  double window_m = 60.0;  ///< Path.
  int min_landmarks = 10;
  double changed_above = 0.3;  ///< Sum of two shares.
};

/// What is told, and how often.
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
