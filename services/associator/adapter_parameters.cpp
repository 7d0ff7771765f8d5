#include "services/associator/adapter_parameters.hpp"

#include "common/bus/noise_parameters.hpp"

namespace understory::associator {

void describe(AssociatorParameters& p, bus::ParameterTable& table) {
  table.add(
      "method", p.method, {"auto", "nearest", "registered", "consistent"},
      "nearest: gated nearest neighbour at the predicted pose. registered: the pose is refined "
      "first. consistent: the largest set that one rigid motion explains. auto: registered, and "
      "consistent where that does not fit.");
  table.add("gate_sigmas", p.gate_sigmas, {0.5, 20.0}, "sigma",
            "Half width of the gate of a pair.");

  table.add("motion_sigma_m", p.motion_sigma_m, {1e-4, 100.0}, "m",
            "Standard deviation per axis of the step between two scans, without odometry.");
  table.add("motion_sigma_rad", p.motion_sigma_rad, {1e-5, 3.2}, "rad",
            "Standard deviation of the rotation between two scans, without odometry.");
  table.add("max_rotation_rad", p.max_rotation_rad, {0.0, 3.2}, "rad",
            "Largest rotation between two scans that is searched, without odometry.");

  table.add(
      "min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
      "Least share of the detections (or of the tracks in view, if fewer) that a scan matches; "
      "below it the scan does not fit.");
  table.add("min_matched", p.min_matched, {0, 1000}, "",
            "Least number of matches of a scan that fits.");

  table.add("confirm_matches", p.confirm_matches, {1, 63}, "scans",
            "[k] A track gets its id after this many matches ...");
  table.add("confirm_window", p.confirm_window, {1, 63}, "scans",
            "[n] ... within this many scans that had it in view.");

  table.add("max_misfits", p.max_misfits, {0, 1000}, "scans",
            "Consecutive scans that fit no track and are skipped; then all tracks start again.");
  table.add(
      "max_missed", p.max_missed, {1, 100000}, "scans",
      "A track ends after this many consecutive scans that had it in view and did not match it.");
  table.add("keep_range_factor", p.keep_range_factor, {1.0, 10.0}, "of the range",
            "Tracks beyond this multiple of the sensor's range end.");

  table.add("min_likelihood_ratio", p.min_likelihood_ratio, {1.0, 1e9}, "",
            "A match is published if it is this many times likelier than any other pairing.");
  table.add("walking_mps", p.walking_mps, {0.0, 100.0}, "m/s",
            "A track that moves against wheels and gyro is not published. Where fewer than three "
            "stationary tracks are in view, a track is published once this speed would have been "
            "noticed. 0: no check.");
  table.add("input.max_detections", p.max_detections, {1, 1000000}, "",
            "LANDMARKS with more detections is refused and counted (too_large): this bounds the "
            "cost of a message. A laser of 2048 columns cannot show 700 trunks.");

  describe(p.noise, table);

  table.renamed("max_turn_rad", "max_rotation_rad");
}

}  // namespace understory::associator
