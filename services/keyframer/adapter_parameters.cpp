#include "services/keyframer/adapter_parameters.hpp"

namespace understory {
namespace {

void describe_source(SourceKeyframerParameters& p, ParameterTable& table) {
  table.add("source.descriptor_step", p.descriptor_step, {0.001, 0.5}, "of the perimeter",
            "[s] Step at which an outline is sampled.");
  table.add("source.max_descriptor_distance", p.max_descriptor_distance, {0.0, 1000.0}, "m",
            "[tau] Polygons farther apart than this do not match.");
  table.add("source.max_side_difference", p.max_side_difference, {0, 100}, "",
            "[Delta_N] Nor do polygons whose numbers of sides differ by more.");
  table.add("source.min_triangle_match_ratio", p.min_triangle_match_ratio, {0.0, 1.0}, "",
            "[eta] Share of triangles that must match inside a matched polygon.");
  table.add("source.min_associations", p.min_associations, {2, 10000}, "",
            "[gamma] Fewest associations of a scan.");
  table.add("source.max_association_distance_m", p.max_association_distance_m, {0.01, 100.0}, "m",
            "[lambda] Largest distance of an association after alignment.");
  table.add("source.cluster_tolerance_m", p.cluster_tolerance_m, {0.01, 100.0}, "m",
            "[sigma] Detections this near to each other are one landmark.");
  table.add("source.observations_per_keyframe", p.observations_per_keyframe, {1, 1000}, "scans",
            "[n] Scans that make a keyframe.");
  table.add("source.stale_after_observations", p.stale_after_observations, {1, 1000}, "scans",
            "[f] A landmark not seen for so many scans is left out.");
}

void describe_joint(JointKeyframerParameters& p, ParameterTable& table) {
  table.add("joint.observations_per_keyframe", p.observations_per_keyframe, {1, 1000}, "scans",
            "Scans that make a keyframe.");
  table.add("joint.gate_sigmas", p.gate_sigmas, {0.1, 100.0}, "sigma", "Association gate.");
  table.add("joint.motion_sigma_m", p.motion_sigma_m, {1e-4, 100.0}, "m",
            "Of the step between two scans, where no odometry tells it.");
  table.add("joint.motion_sigma_rad", p.motion_sigma_rad, {1e-5, 3.2}, "rad",
            "Of the turn between two scans, where no odometry tells it.");
  table.add("joint.max_turn_rad", p.max_turn_rad, {0.0, 3.2}, "rad",
            "Largest unpredicted turn between two scans that is searched.");
  table.add("joint.min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
            "Of the detections (or of the landmarks, if fewer): below, a scan is lost.");
  table.add("joint.min_matched", p.min_matched, {1, 1000}, "",
            "Fewest matches of a scan without odometry.");
  table.add("joint.min_sightings", p.min_sightings, {1, 1000}, "scans",
            "A landmark seen less often does not pass.");
}

}  // namespace

void describe(KeyframerParameters& parameters, ParameterTable& table) {
  table.add("method", parameters.method, {"joint", "source"},
            "joint: ours. source: as the thesis describes it.");
  describe_joint(parameters.joint, table);
  describe_source(parameters.source, table);
}

}  // namespace understory
