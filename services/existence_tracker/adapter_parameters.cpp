#include "services/existence_tracker/adapter_parameters.hpp"

namespace understory::existence_tracker {
namespace {

void describe(existence::Parameters& p, bus::ParameterTable& table) {
  table.add("model.prior", p.prior, {1e-6, 1.0 - 1e-6}, "",
            "Probability of a landmark of a given map that has no state, before its first look.");
  table.add("model.birth", p.birth, {1e-6, 1.0 - 1e-6}, "",
            "Share of new landmarks that are real: start value, learned.");
  table.add("model.visibility", p.visibility, {0.01, 0.999}, "",
            "[w0] Probability of a free line of sight: start value and maximum.");
  table.add("model.false_rate", p.false_rate, {1e-9, 0.49}, "",
            "[eps] Share of looks at an empty place that give a false detection.");
  table.add("model.recall", p.recall, {0.01, 0.999}, "",
            "[p_d] Share of looks at a visible landmark that detect it: start value, learned.");
  table.add("model.recall_weight", p.recall_weight, {1.0, 1e6}, "looks",
            "Weight of that start value.");
  table.add("model.pass_recall", p.pass_recall, {0.01, 1.0}, "",
            "Share of passes that can detect a landmark: start value, learned. 1: all can.");
  table.add("model.pass_recall_weight", p.pass_recall_weight, {1.0, 1e6}, "passes",
            "Weight of that start value.");
  table.add(
      "model.drives_alike", p.drives_alike, {1.0, 1e6}, "passes",
      "Weight of that share, as learned in earlier drives, for the next drive; also its maximum.");
  table.add("model.drives_unlike", p.drives_unlike, {1e-6, 0.999}, "",
            "Share of drives to which the share of earlier drives does not apply: leaves, rain, "
            "another season.");
  table.add("model.drives_hidden", p.drives_hidden, {1e-6, 0.999}, "",
            "Share of drives with a new obstacle, which may hide any share of the landmarks from "
            "one side.");
  table.add("model.range_m", p.range_m, {1.0, 1000.0}, "m",
            "Range of the detector, used for a landmark that was not detected yet.");
  table.add("model.decay_per_s", p.decay_per_s, {0.0, 1.0}, "1/s",
            "[lambda] Rate at which landmarks cease to exist: start value. 1.6e-9: 5 % a year.");
  table.add("model.decay_weight", p.decay_weight, {0.0, 1e6}, "landmarks",
            "Weight of that start value; 0: it is not learned.");
  table.add("model.relax_per_s", p.relax_per_s, {0.0, 1.0}, "1/s",
            "[mu] Rate at which the learned directions of view of a landmark are forgotten.");
  table.add("model.passed_by", p.passed_by, {1e-6, 0.999}, "",
            "Share of viewpoints whose rays pass beside an existing landmark.");
  table.add("model.learn_recall", p.learn_recall,
            "Learn both shares from surely existing landmarks.");
  table.add("model.learn_visibility", p.learn_visibility,
            "Learn the viewpoints from which each landmark is visible. Without it repeated misses "
            "from one place count each time.");
}

void describe(UseParameters& p, bus::ParameterTable& table) {
  table.add("use.drop_below", p.drop_below, {0.0, 1.0}, "",
            "Probability below which a landmark leaves use; it is kept.");
  table.add("use.readmit_above", p.readmit_above, {0.0, 1.0}, "",
            "Probability above which it is used again.");
}

void describe(LookParameters& p, bus::ParameterTable& table) {
  table.add("looks.pass_s", p.pass_s, {0.0, 1e9}, "s",
            "Least duration of one pass of a landmark: causes of misses and detections stay the "
            "same from lane to lane.");
  table.add("looks.pass_m", p.pass_m, {1.0, 1e6}, "m",
            "Path length of a pass after which another one may begin: an obstacle may have gone.");
  table.add("looks.same_pass_m", p.same_pass_m, {0.0, 1e6}, "m",
            "Looks within this path length belong to the same pass, up to pass_m of it.");
  table.add("looks.min_inliers", p.min_inliers, {0, 10000}, "",
            "Least number of landmarks that place a keyframe whose missed landmarks count.");
  table.add(
      "looks.use_ranges", p.use_ranges,
      "Use the ranges measured along the rays: misses of hidden landmarks then do not count.");
}

void describe(NeedParameters& p, bus::ParameterTable& table) {
  table.add("need.window_m", p.window_m, {1.0, 10000.0}, "m",
            "Path length over which the map is compared with the detections.");
  table.add("need.min_landmarks", p.min_landmarks, {1, 100000}, "",
            "With fewer landmarks the map is not judged.");
  table.add("need.changed_above", p.changed_above, {0.0, 2.0}, "",
            "Mapping is needed if the share of missing landmarks (beyond the detector's misses) "
            "and the share of detected ones that are new to the map together exceed this.");
}

void describe(OutputParameters& p, bus::ParameterTable& table) {
  table.add("output.told_change", p.told_change, {0.0, 1.0}, "",
            "Least change of a probability that EXISTENCE reports.");
  table.add("output.repeated", p.repeated, {0, 10000}, "landmarks",
            "Further landmarks in each EXISTENCE, in turn: subscribers that missed a message get "
            "all in the end.");
  table.add("output.state_period_s", p.state_period_s, {0.1, 1e6}, "s",
            "Message time from one EXISTENCE_STATE to the next; a power failure loses this much.");
}

}  // namespace

void describe(TrackerParameters& parameters, bus::ParameterTable& table) {
  describe(parameters.model, table);
  describe(parameters.use, table);
  describe(parameters.looks, table);
  describe(parameters.need, table);
  describe(parameters.output, table);
}

}  // namespace understory::existence_tracker
