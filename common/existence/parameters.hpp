// Parameters of the model.
#pragma once

namespace understory::existence {

/// Probabilities are in (0, 1), rates per second. The notation of the thesis in brackets.
struct Parameters {
  double prior = 0.99;       ///< P of a point from another source, before its first look.
  double birth = 0.7;        ///< Share of new points that are real: start value, learned.
  double visibility = 0.95;  ///< [w0] Visibility before any look, and its upper limit; below 1.
  double false_rate = 0.01;  ///< [eps] Probability of a false sighting in a look at no point.
  double recall = 0.9;       ///< [p_d] Share of looks at a visible point that see it: start value.
  double recall_weight = 20.0;  ///< Weight of `recall` in looks.
  double pass_recall = 0.7;  ///< [v] Share of passes that can see a point: start value; 1: all do.
  double pass_recall_weight = 4.0;  ///< Weight of `pass_recall` in points and passes.
  double drives_alike = 100.0;  ///< Weight of the earlier drives' v for the next drive, in passes.
  double drives_unlike = 0.05;  ///< Share of the drives for which v is arbitrary.
  double drives_hidden = 0.4;   ///< Share of drives with a new obstacle, which hides any share of
                                ///< the points observed from one side only.
  double range_m = 40.0;        ///< Range of the sensor.
  double decay_per_s = 0.0;     ///< [lambda] Rate at which points cease to exist: start value.
  double decay_weight = 0.0;  ///< Weight of `decay_per_s` in removed points; 0: it is not learned.
  double relax_per_s = 1.4e-5;  ///< [mu] Rate at which visibility is forgotten: time constant 20 h.
  double passed_by = 0.2;       ///< Share of viewpoints whose rays pass beside an existing point.
  bool learn_recall = true;     ///< Learn the recall of looks and passes.
  bool learn_visibility =
      true;  ///< Redundancy control; without it every look counts as the first one.
};

/// Throws std::invalid_argument with the first impossible parameter and its allowed range.
void check(const Parameters& parameters);

}  // namespace understory::existence
