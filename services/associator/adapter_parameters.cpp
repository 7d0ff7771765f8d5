#include "services/associator/adapter_parameters.hpp"

namespace understory::associator {

void describe(AssociatorParameters& p, bus::ParameterTable& table) {
  table.add(
      "method", p.method, {"auto", "nearest", "registered", "consistent"},
      "nearest: gated nearest neighbour at the predicted pose. registered: the pose is refined "
      "first. consistent: the largest set that one rigid motion explains. auto: registered, "
      "consistent where that fits badly.");
  table.add("gate_sigmas", p.gate_sigmas, {0.5, 20.0}, "sigma", "Gate of a pair.");
  table.add("motion_sigma_m", p.motion_sigma_m, {1e-4, 100.0}, "m",
            "Of the step between two scans, where only the last one predicts it.");
  table.add("motion_sigma_rad", p.motion_sigma_rad, {1e-5, 3.2}, "rad",
            "Of the turn between two scans, where only the last one predicts it.");
  table.add("max_rotation_rad", p.max_rotation_rad, {0.0, 3.2}, "rad",
            "Largest unpredicted turn between two scans that is searched.");
  table.add("min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
            "Of what could match: below, a scan is lost and all tracks begin anew.");
  table.add("min_matched", p.min_matched, {0, 1000}, "", "Fewest matches of a scan that fits.");
  table.add("confirm_matches", p.confirm_matches, {1, 63}, "scans",
            "[k] A track gets its id once it was matched so often ...");
  table.add("confirm_window", p.confirm_window, {1, 63}, "scans",
            "[n] ... in so many scans that should show it.");
  table.add("max_misfits", p.max_misfits, {0, 1000}, "scans",
            "In a row that fit no track and are passed over; then all tracks begin anew.");
  table.add("max_missed", p.max_missed, {1, 100000}, "scans",
            "In a row, that should have shown a track and did not: it ends.");
  table.add("keep_range_factor", p.keep_range_factor, {1.0, 10.0}, "of the range",
            "Tracks farther than this end.");
  table.add("min_likelihood_ratio", p.min_likelihood_ratio, {1.0, 1e9}, "",
            "A match is published if it is so many times likelier than any other pairing.");
  table.add("walking_mps", p.walking_mps, {0.0, 100.0}, "m/s",
            "What moves against the wheels is no landmark; where few that stand are in view, a "
            "track is published once this speed would have been noticed. 0: nothing is checked.");
  table.renamed("max_turn_rad", "max_rotation_rad");
}

}  // namespace understory::associator
