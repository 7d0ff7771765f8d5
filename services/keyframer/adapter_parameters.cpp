#include "services/keyframer/adapter_parameters.hpp"

namespace understory::keyframer {
namespace {

void describe_baseline(BaselineKeyframerParameters& p, bus::ParameterTable& table) {
  table.add("baseline.descriptor_step", p.descriptor_step, {0.001, 0.5}, "of the perimeter",
            "[s] Step at which an outline is sampled.");
  table.add("baseline.max_descriptor_distance", p.max_descriptor_distance, {0.0, 1000.0}, "m",
            "[tau] Polygons farther apart than this do not match.");
  table.add("baseline.max_side_difference", p.max_side_difference, {0, 100}, "",
            "[Delta_N] Nor do polygons whose numbers of sides differ by more.");
  table.add("baseline.min_triangle_match_ratio", p.min_triangle_match_ratio, {0.0, 1.0}, "",
            "[eta] Share of triangles that must match inside a matched polygon.");
  table.add("baseline.min_associations", p.min_associations, {2, 10000}, "",
            "[gamma] Fewest associations of a scan.");
  table.add("baseline.max_association_distance_m", p.max_association_distance_m, {0.01, 100.0}, "m",
            "[lambda] Largest distance of an association after alignment.");
  table.add("baseline.cluster_tolerance_m", p.cluster_tolerance_m, {0.01, 100.0}, "m",
            "[sigma] Detections this near to each other are one landmark.");
  table.add("baseline.observations_per_keyframe", p.observations_per_keyframe, {1, 1000}, "scans",
            "[n] Scans that make a keyframe.");
  table.add("baseline.stale_after_observations", p.stale_after_observations, {1, 1000}, "scans",
            "[f] A landmark not seen for so many scans is left out.");
}

void describe_joint(JointKeyframerParameters& p, bus::ParameterTable& table) {
  table.add("joint.observations_per_keyframe", p.observations_per_keyframe, {1, 1000}, "scans",
            "Scans that make a keyframe.");
  table.add("joint.gate_sigmas", p.gate_sigmas, {0.1, 100.0}, "sigma", "Association gate.");
  table.add("joint.motion_sigma_m", p.motion_sigma_m, {1e-4, 100.0}, "m",
            "Of the step between two scans, where no odometry tells it.");
  table.add("joint.motion_sigma_rad", p.motion_sigma_rad, {1e-5, 3.2}, "rad",
            "Of the turn between two scans, where no odometry tells it.");
  table.add("joint.max_rotation_rad", p.max_rotation_rad, {0.0, 3.2}, "rad",
            "Largest unpredicted turn between two scans that is searched.");
  table.add("joint.min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
            "Of the detections (or of the landmarks, if fewer): below, a scan is lost.");
  table.add("joint.min_matched", p.min_matched, {1, 1000}, "",
            "Fewest matches of a scan without odometry.");
  table.add("joint.min_observations", p.min_observations, {1, 1000}, "scans",
            "A landmark seen less often does not pass.");
}

}  // namespace

void describe(KeyframerParameters& parameters, bus::ParameterTable& table) {
  table.add("method", parameters.method, {"joint", "baseline"},
            "joint: this project's; baseline: as the GeoSLAM thesis describes it.");
  describe_joint(parameters.joint, table);
  describe_baseline(parameters.baseline, table);
  table.renamed("source.", "baseline.");
  table.renamed("joint.min_sightings", "joint.min_observations");
  table.renamed("joint.max_turn_rad", "joint.max_rotation_rad");
  table.renamed_choice("method", "source", "baseline");
}

}  // namespace understory::keyframer
