#include "services/keyframer/adapter_parameters.hpp"

#include "common/bus/noise_parameters.hpp"

namespace understory::keyframer {
namespace {

void describe_joint(JointKeyframerParameters& p, bus::ParameterTable& table) {
  table.add("joint.observations_per_keyframe", p.observations_per_keyframe, {1, 1000}, "scans",
            "Scans that make a keyframe.");
  table.add("joint.gate_sigmas", p.gate_sigmas, {0.1, 100.0}, "sigma",
            "Half width of the association gate.");

  table.add("joint.motion_sigma_m", p.motion_sigma_m, {1e-4, 100.0}, "m",
            "Standard deviation per axis of the step between two scans, without odometry.");
  table.add("joint.motion_sigma_rad", p.motion_sigma_rad, {1e-5, 3.2}, "rad",
            "Standard deviation of the rotation between two scans, without odometry.");
  table.add("joint.max_rotation_rad", p.max_rotation_rad, {0.0, 3.2}, "rad",
            "Largest rotation between two scans that is searched, without odometry.");
  table.add("joint.min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
            "Least share of the detections (or of the landmarks in view, if fewer) that a scan "
            "without odometry must match; below it tracking starts again.");
  table.add("joint.min_matched", p.min_matched, {1, 1000}, "",
            "Least number of matches of a scan without odometry.");
  table.add("joint.min_observations", p.min_observations, {1, 1000}, "scans",
            "Least number of scans that detected a landmark of a keyframe (all scans, if tracking "
            "has had fewer).");
}

}  // namespace

void describe(KeyframerParameters& parameters, bus::ParameterTable& table) {
  table.add("input.max_detections", parameters.max_detections, {1, 1000000}, "",
            "LANDMARKS with more detections is refused and counted (too_large): this bounds the "
            "cost of a message. A laser of 2048 columns cannot show 700 trunks.");
  describe_joint(parameters.joint, table);
  describe(parameters.joint.noise, table);

  table.renamed("joint.min_sightings", "joint.min_observations");
  table.renamed("joint.max_turn_rad", "joint.max_rotation_rad");
  // Earlier versions could choose the method of the thesis.
  const std::string where = "the method of the GeoSLAM thesis runs in understory eval alone";
  table.removed("method", "the keyframer has one method now; " + where);
  table.removed("baseline.", where);
  table.removed("source.", where);
}

}  // namespace understory::keyframer
