#include "services/geoslam_mapper/adapter_parameters.hpp"

namespace understory {
namespace {

void describe_source(SourceMapperParameters& p, ParameterTable& table) {
  table.add("source.descriptor_step", p.descriptor_step, {0.001, 0.5}, "of the perimeter",
            "[s] Step at which an outline is sampled.");
  table.add("source.max_side_difference", p.max_side_difference, {0, 100}, "",
            "[Delta_N] Polygons whose numbers of sides differ by more do not match.");
  table.add("source.min_triangle_match_ratio", p.min_triangle_match_ratio, {0.0, 1.0}, "",
            "[eta] Share of triangles that must match inside a matched polygon.");
  table.add("source.initial_descriptor_distance", p.initial_descriptor_distance, {0.0, 1000.0}, "m",
            "[tau] Descriptor distance with which the search begins.");
  table.add("source.descriptor_distance_step", p.descriptor_distance_step, {0.001, 1000.0}, "m",
            "[psi] By how much it widens.");
  table.add("source.max_descriptor_distance", p.max_descriptor_distance, {0.0, 1000.0}, "m",
            "Where it ends.");
  table.add("source.min_associations", p.min_associations, {2, 10000}, "",
            "[gamma] Fewest associations with which a pose is tried.");
  table.add("source.max_pose_attempts", p.max_pose_attempts, {1, 1000000}, "",
            "[alpha] Most samples drawn for a pose.");
  table.add("source.pose_sample_size", p.pose_sample_size, {2, 100}, "",
            "[xi] Associations in one sample.");
  table.add("source.association_distance_m", p.association_distance_m, {0.001, 100.0}, "m",
            "[Lambda] Largest distance of an inlier.");
  table.add("source.discovery_distance_m", p.discovery_distance_m, {0.001, 1000.0}, "m",
            "[rho] A detection farther than this from the map may be new.");
  table.add("source.sensor_range_m", p.sensor_range_m, {0.1, 10000.0}, "m", "[r] Of the sensor.");
  table.add("source.min_pose_associations", p.min_pose_associations, {2, 10000}, "",
            "[mu] Fewest inliers of a pose.");
  table.add("source.early_exit_ratio", p.early_exit_ratio, {0.0, 1.0}, "",
            "[beta] Share of inliers at which no more samples are drawn.");
  table.add("source.discovery_observations", p.discovery_observations, {1, 1000}, "keyframes",
            "[k] So often a new landmark must be seen ...");
  table.add("source.discovery_window", p.discovery_window, {1, 1000}, "keyframes",
            "[omega] ... within so many keyframes.");
  table.add("source.discovery_association_m", p.discovery_association_m, {0.001, 100.0}, "m",
            "[delta] Sightings of a new landmark this near to each other are one.");
  table.add("source.max_newest_pose_error", p.max_newest_pose_error, {0.0, 1e12}, "",
            "Error of the newest pose beyond which the update is rolled back.");
}

void describe_evidence(SmoothingMapperParameters& p, ParameterTable& table) {
  table.add("ours.relinearise_above", p.relinearise_above, {1e-6, 1.0}, "sigma",
            "A measurement is linearised again beyond this: 1e-4 on long open roads.");
  table.add("ours.gate_sigmas", p.gate_sigmas, {0.1, 100.0}, "sigma", "Association gate.");
  table.add("ours.gate_floor_m", p.gate_floor_m, {0.0, 10.0}, "m", "Added to the gate.");
  table.add("ours.predicted_sigma_m", p.predicted_sigma_m, {1e-4, 100.0}, "m",
            "Of a predicted pose that no odometry made.");
  table.add("ours.predicted_sigma_rad", p.predicted_sigma_rad, {1e-5, 3.2}, "rad",
            "Of the heading of a predicted pose that no odometry made.");
  table.add("ours.filter_disagreement_m", p.filter_disagreement_m, {0.0, 100.0}, "m",
            "a keyframe with at most two landmarks that moves so much otherwise than the filter "
            "is not believed; 0: the filter is not asked");
  table.add("ours.min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
            "Of what can be matched: below, a predicted pose is not believed.");
  table.add("ours.lasting_share", p.lasting_share, {0.0, 0.9}, "",
            "Of a sighting's variance: what stays the same over lasting_m; 0 = all is new.");
  table.add("ours.lasting_m", p.lasting_m, {0.01, 1000.0}, "m",
            "Way over which what lasts of a sighting's error fades.");
  table.add("ours.standing_share", p.standing_share, {0.0, 1.0}, "",
            "Of a sighting's variance: what stays the same while the vehicle stands.");
  table.add("ours.scale_sigma", p.scale_sigma, {0.0, 0.1}, "",
            "Of distances, the same for all landmarks and for ever: told in covariances.");
  table.add("ours.start_heading_sigma_rad", p.start_heading_sigma_rad, {1e-5, 10.0}, "rad",
            "A map begins with a keyframe whose ends the odometry ties to so much heading...");
  table.add("ours.start_wait_s", p.start_wait_s, {0.0, 60.0}, "s",
            "... or, after so long, with any.");
  table.add("ours.min_matched", p.min_matched, {1, 1000}, "",
            "Fewest matches of a pose that odometry does not support.");
  table.add("ours.outlier_chi2", p.outlier_chi2, {1.0, 1e6}, "",
            "Of one association after the update (2 degrees of freedom): it is taken out.");
  table.add("ours.max_innovation_sigmas", p.max_innovation_sigmas, {1.0, 1e6}, "sigma",
            "chi^2 of all associations as a normal deviate: beyond, the update is rolled back.");
}

void describe_growth(SmoothingMapperParameters& p, ParameterTable& table) {
  table.add("ours.use_odometry", p.use_odometry, "ODOMETRY between keyframes as a factor.");
  table.add("ours.gyro_walk", p.gyro_walk, {0.0, 1.0}, "rad/s/sqrt(s)",
            "Random walk of the gyro's bias in the graph; 0 = the filter's word is taken for it.");
  table.add("ours.localisation_only", p.localisation_only, "Never change the map that was given.");
  table.add("ours.recent_keyframes", p.recent_keyframes, {1, 100000}, "keyframes",
            "Landmarks seen within so many share their error with the pose.");
  table.add("ours.min_sightings", p.min_sightings, {1, 1000}, "",
            "A landmark enters the map when it was detected so often.");
  table.add("ours.min_sighting_ratio", p.min_sighting_ratio, {0.0, 1.0}, "",
            "... and in this share of the scans that had it in view.");
  table.add("ours.candidate_keyframes", p.candidate_keyframes, {1, 100000}, "keyframes",
            "A candidate seen too seldom is forgotten after so many.");
  table.add("ours.merge_distance_m", p.merge_distance_m, {0.0, 100.0}, "m",
            "Two landmarks this near that were never seen from one place are one.");
  table.add("ours.fold_distance_m", p.fold_distance_m, {0.0, 100.0}, "m",
            "A keyframe this near to an earlier one and similarly turned is folded into it.");
  table.add("ours.fold_angle_rad", p.fold_angle_rad, {0.0, 3.2}, "rad", "How similarly turned.");
  table.add("ours.given_map_sigma_m", p.given_map_sigma_m, {1e-4, 100.0}, "m",
            "Of the landmarks of a given map that states no covariance.");
}

}  // namespace

void describe(MapperParameters& parameters, ParameterTable& table) {
  table.add("method", parameters.method, {"ours", "source"},
            "ours, or source: as the thesis describes it.");
  describe_evidence(parameters.ours, table);
  describe_growth(parameters.ours, table);
  describe_source(parameters.source, table);
}

void describe(MapperOutputParameters& parameters, ParameterTable& table) {
  table.add("output.map_period_s", parameters.map_period_s, {0.05, 3600.0}, "s",
            "MAP is published at most this often (message time), where it has changed.");
  table.add("output.moved_m", parameters.moved_m, {0.0, 10.0}, "m",
            "MAP_DELTA leaves out landmarks that moved less since they were last in it.");
  table.add("output.reset_distance_m", parameters.reset_distance_m, {0.001, 1000.0}, "m",
            "SLAM_POSE counts a reset where the pose jumps farther ...");
  table.add("output.reset_angle_rad", parameters.reset_angle_rad, {0.001, 3.2}, "rad",
            "... or turns more than this against its prediction.");
}

}  // namespace understory
