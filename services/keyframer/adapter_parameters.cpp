#include "services/keyframer/adapter_parameters.hpp"

#include "common/bus/noise_parameters.hpp"

namespace understory::keyframer {
namespace {

void describe_baseline(BaselineKeyframerParameters& p, bus::ParameterTable& table) {
  table.add("baseline.descriptor_step", p.descriptor_step, {0.001, 0.5}, "of the perimeter",
            "[s] Step at which an outline is sampled.");
  table.add("baseline.max_descriptor_distance", p.max_descriptor_distance, {0.0, 1000.0}, "m",
            "[tau] Polygons with a larger descriptor distance do not match.");
  table.add("baseline.max_side_difference", p.max_side_difference, {0, 100}, "",
            "[Delta_N] Largest difference of the numbers of sides of two polygons that match.");
  table.add("baseline.min_triangle_match_ratio", p.min_triangle_match_ratio, {0.0, 1.0}, "",
            "[eta] Least share of triangles that must match inside a matched polygon.");

  table.add("baseline.min_associations", p.min_associations, {2, 10000}, "",
            "[gamma] Least number of associations of a scan.");
  table.add("baseline.max_association_distance_m", p.max_association_distance_m, {0.01, 100.0}, "m",
            "[lambda] Largest distance of an association after alignment.");
  table.add("baseline.cluster_tolerance_m", p.cluster_tolerance_m, {0.01, 100.0}, "m",
            "[sigma] Detections within this distance of each other are one landmark.");

  table.add("baseline.observations_per_keyframe", p.observations_per_keyframe, {1, 1000}, "scans",
            "[n] Scans that make a keyframe.");
  table.add("baseline.stale_after_observations", p.stale_after_observations, {1, 1000}, "scans",
            "[f] A scan that matched no other one for so many scans is dropped; a keyframe that "
            "no scan has joined for so many scans is published.");
}

void describe_joint(JointKeyframerParameters& p, bus::ParameterTable& table) {
  table.add("joint.observations_per_keyframe", p.observations_per_keyframe, {1, 1000}, "scans",
            "Scans that make a keyframe.");
  table.add("joint.gate_sigmas", p.gate_sigmas, {0.1, 100.0}, "sigma",
            "Half width of the association gate.");

  table.add(
      "joint.motion_sigma_m", p.motion_sigma_m, {1e-4, 100.0}, "m",
      "Standard deviation per axis of the step between two scans, where there is no odometry.");
  table.add("joint.motion_sigma_rad", p.motion_sigma_rad, {1e-5, 3.2}, "rad",
            "Standard deviation of the rotation between two scans, where there is no odometry.");
  table.add("joint.max_rotation_rad", p.max_rotation_rad, {0.0, 3.2}, "rad",
            "Largest unpredicted rotation between two scans that is searched.");
  table.add("joint.min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
            "Least share of the detections (or of the landmarks in view, if fewer) that a scan "
            "without odometry must match; below it tracking starts anew.");
  table.add("joint.min_matched", p.min_matched, {1, 1000}, "",
            "Least number of matches of a scan without odometry.");
  table.add(
      "joint.min_observations", p.min_observations, {1, 1000}, "scans",
      "Least number of scans that detected a landmark of a keyframe (all, where tracking began "
      "fewer scans ago).");
}

}  // namespace

void describe(KeyframerParameters& parameters, bus::ParameterTable& table) {
  table.add(
      "method", parameters.method, {"joint", "baseline"},
      "joint: scans and landmarks are estimated together; baseline: the method of the GeoSLAM "
      "thesis (section 4.2).");
  table.add("input.max_detections", parameters.max_detections, {1, 1000000}, "",
            "LANDMARKS with more detections is refused and counted (too_large): what a message may "
            "cost is bounded. A laser of 2048 columns cannot show 700 trunks.");
  describe_joint(parameters.joint, table);
  describe(parameters.joint.noise, table);
  describe_baseline(parameters.baseline, table);

  table.renamed("source.", "baseline.");
  table.renamed("joint.min_sightings", "joint.min_observations");
  table.renamed("joint.max_turn_rad", "joint.max_rotation_rad");
  table.renamed_choice("method", "source", "baseline");
}

}  // namespace understory::keyframer
