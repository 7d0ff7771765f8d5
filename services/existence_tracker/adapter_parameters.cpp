#include "services/existence_tracker/adapter_parameters.hpp"

namespace understory::existence_tracker {
namespace {

void describe(existence::Parameters& p, bus::ParameterTable& table) {
  table.add("model.prior", p.prior, {1e-6, 1.0 - 1e-6}, "",
            "Probability of a landmark of a given map that has no state, before its first look.");
  table.add("model.birth", p.birth, {1e-6, 1.0 - 1e-6}, "",
            "Share of new landmarks that are real: start value, learned.");
  table.add("model.visibility", p.visibility, {0.01, 0.999}, "",
            "[w0] Probability of a free line of sight before any look, and at most.");
  table.add("model.false_rate", p.false_rate, {1e-9, 0.49}, "",
            "[eps] Share of looks at nothing that are taken for a sighting.");
  table.add("model.recall", p.recall, {0.01, 0.999}, "",
            "[p_d] Share of looks at a visible landmark that see it: start value, learned.");
  table.add("model.recall_weight", p.recall_weight, {1.0, 1e6}, "looks",
            "What that start value counts for.");
  table.add("model.pass_recall", p.pass_recall, {0.01, 1.0}, "",
            "Share of passes that can see a landmark at all: start value, learned. 1: all can.");
  table.add("model.pass_recall_weight", p.pass_recall_weight, {1.0, 1e6}, "passes",
            "What that start value counts for.");
  table.add("model.drives_alike", p.drives_alike, {1.0, 1e6}, "passes",
            "What that share of the drives before counts for at the next one, and at most.");
  table.add("model.drives_unlike", p.drives_unlike, {1e-6, 0.999}, "",
            "Share of drives that say nothing of each other: leaves, rain, another season.");
  table.add("model.drives_hidden", p.drives_hidden, {1e-6, 0.999}, "",
            "Share of drives with something new in the way, which may hide any share of what they "
            "look at "
            "from one side only.");
  table.add("model.range_m", p.range_m, {1.0, 1000.0}, "m",
            "Range of the detector, up to which a landmark should be seen before it was seen.");
  table.add("model.decay_per_s", p.decay_per_s, {0.0, 1.0}, "1/s",
            "[lambda] Rate at which landmarks cease to exist: start value. 1.6e-9: 5 % a year.");
  table.add("model.decay_weight", p.decay_weight, {0.0, 1e6}, "landmarks",
            "What that start value counts for; 0: it is not learned.");
  table.add("model.relax_per_s", p.relax_per_s, {0.0, 1.0}, "1/s",
            "[mu] Rate at which it is forgotten from where a landmark can be seen.");
  table.add("model.passed_by", p.passed_by, {1e-6, 0.999}, "",
            "Share of viewpoints whose rays pass beside a landmark that is there.");
  table.add("model.learn_recall", p.learn_recall,
            "Learn both shares from surely existing landmarks.");
  table.add("model.learn_visibility", p.learn_visibility,
            "Learn from where each landmark can be seen. Without it misses from one place count "
            "again and again.");
}

void describe(UseParameters& p, bus::ParameterTable& table) {
  table.add("use.drop_below", p.drop_below, {0.0, 1.0}, "",
            "Probability below which a landmark is taken for gone: it is not used, but kept.");
  table.add("use.readmit_above", p.readmit_above, {0.0, 1.0}, "",
            "Probability above which it is used again.");
}

void describe(LookParameters& p, bus::ParameterTable& table) {
  table.add(
      "looks.pass_s", p.pass_s, {0.0, 1e9}, "s",
      "A drive's pass of a landmark lasts so long at least: what makes a detector miss it, or "
      "see it, is the same from lane to lane.");
  table.add("looks.pass_m", p.pass_m, {1.0, 1e6}, "m",
            "Path after which another pass may begin then: what hid a landmark may be gone.");
  table.add(
      "looks.same_pass_m", p.same_pass_m, {0.0, 1e6}, "m",
      "What was looked at within so much path is still in the same pass, up to pass_m of it.");
  table.add("looks.min_inliers", p.min_inliers, {0, 10000}, "",
            "Landmarks by which a keyframe must be placed, for what it did not see to count.");
  table.add(
      "looks.use_ranges", p.use_ranges,
      "Whether what the sensor measured along the ray counts: hidden things say nothing then.");
}

void describe(NeedParameters& p, bus::ParameterTable& table) {
  table.add("need.window_m", p.window_m, {1.0, 10000.0}, "m",
            "Path over which it is judged whether the map still tells where the vehicle is.");
  table.add("need.min_landmarks", p.min_landmarks, {1, 100000}, "",
            "With fewer landmarks nothing is said.");
  table.add("need.changed_above", p.changed_above, {0.0, 2.0}, "",
            "Mapping is needed where the share of landmarks that were not seen, beyond what the "
            "detector misses anyhow, and the share of seen ones that are new to the map are more "
            "than this together.");
}

void describe(OutputParameters& p, bus::ParameterTable& table) {
  table.add("output.told_change", p.told_change, {0.0, 1.0}, "",
            "Change of a probability from which EXISTENCE tells it.");
  table.add("output.repeated", p.repeated, {0, 10000}, "landmarks",
            "That each EXISTENCE tells beside, in turn: who missed a message has all in the end.");
  table.add("output.state_period_s", p.state_period_s, {0.1, 1e6}, "s",
            "Message time from one EXISTENCE_STATE to the next, and what is lost where the power "
            "fails.");
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
