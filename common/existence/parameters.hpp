// What the model is told.
#pragma once

namespace understory::existence {

/// Probabilities are in (0, 1), rates per second. The notation of the thesis in brackets.
struct Parameters {
  double prior = 0.99;       ///< P of a point that is known from elsewhere, before its first look.
  double birth = 0.7;        ///< Share of new points that are real: start value, learned.
  double visibility = 0.95;  ///< [w0] Free line of sight before any look, and at most; below 1.
  double false_rate = 0.01;  ///< [eps] A look at nothing is taken for a sighting.
  double recall = 0.9;       ///< [p_d] Share of looks at a visible point that see it: start value.
  double recall_weight = 20.0;  ///< What `recall` counts for, in looks.
  double pass_recall = 0.7;  ///< [v] Share of passes that can see a point: start value; 1: all do.
  double pass_recall_weight = 4.0;  ///< What `pass_recall` counts for, in points and passes.
  double drives_alike = 100.0;      ///< What v of the drives before counts for at the next one,
  double drives_unlike = 0.05;      ///< but for this share of the drives: v may be anything there.
  double drives_hidden = 0.4;   ///< Share of drives with something new in the way, which hides any
                                ///< share of what they look at from one side only.
  double range_m = 40.0;        ///< Of the sensor.
  double decay_per_s = 0.0;     ///< [lambda] Rate at which points cease to exist: start value.
  double decay_weight = 0.0;    ///< What it counts for, in points that went; 0: it is not learned.
  double relax_per_s = 1.4e-5;  ///< [mu] Rate at which visibility is forgotten: once in 20 h.
  double passed_by = 0.2;    ///< Share of viewpoints whose rays pass beside a point that is there.
  bool learn_recall = true;  ///< Of looks and passes.
  bool learn_visibility =
      true;  ///< Redundancy control; without it each look is as good as a first.
};

/// Throws std::invalid_argument that names the first parameter that cannot be, and what is allowed.
void check(const Parameters& parameters);

}  // namespace understory::existence
