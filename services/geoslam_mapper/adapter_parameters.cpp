#include "services/geoslam_mapper/adapter_parameters.hpp"

namespace understory::geoslam_mapper {
namespace {

void describe_baseline(BaselineMapperParameters& p, bus::ParameterTable& table) {
  table.add("baseline.descriptor_step", p.descriptor_step, {0.001, 0.5}, "of the perimeter",
            "[s] Step at which an outline is sampled.");
  table.add("baseline.max_side_difference", p.max_side_difference, {0, 100}, "",
            "[Delta_N] Polygons whose numbers of sides differ by more do not match.");
  table.add("baseline.min_triangle_match_ratio", p.min_triangle_match_ratio, {0.0, 1.0}, "",
            "[eta] Share of triangles that must match inside a matched polygon.");
  table.add("baseline.initial_descriptor_distance", p.initial_descriptor_distance, {0.0, 1000.0},
            "m", "[tau] Descriptor distance with which the search begins.");
  table.add("baseline.descriptor_distance_step", p.descriptor_distance_step, {0.001, 1000.0}, "m",
            "[psi] By how much it widens.");
  table.add("baseline.max_descriptor_distance", p.max_descriptor_distance, {0.0, 1000.0}, "m",
            "Where it ends.");
  table.add("baseline.min_associations", p.min_associations, {2, 10000}, "",
            "[gamma] Fewest associations with which a pose is tried.");
  table.add("baseline.max_pose_attempts", p.max_pose_attempts, {1, 1000000}, "",
            "[alpha] Most samples drawn for a pose.");
  table.add("baseline.pose_sample_size", p.pose_sample_size, {2, 100}, "",
            "[xi] Associations in one sample.");
  table.add("baseline.association_distance_m", p.association_distance_m, {0.001, 100.0}, "m",
            "[Lambda] Largest distance of an inlier.");
  table.add("baseline.discovery_distance_m", p.discovery_distance_m, {0.001, 1000.0}, "m",
            "[rho] A detection farther than this from the map may be new.");
  table.add("baseline.sensor_range_m", p.sensor_range_m, {0.1, 10000.0}, "m", "[r] Of the sensor.");
  table.add("baseline.min_pose_associations", p.min_pose_associations, {2, 10000}, "",
            "[mu] Fewest inliers of a pose.");
  table.add("baseline.early_exit_ratio", p.early_exit_ratio, {0.0, 1.0}, "",
            "[beta] Share of inliers at which no more samples are drawn.");
  table.add("baseline.discovery_observations", p.discovery_observations, {1, 1000}, "keyframes",
            "[k] So often a new landmark must be seen ...");
  table.add("baseline.discovery_window", p.discovery_window, {1, 1000}, "keyframes",
            "[omega] ... within so many keyframes.");
  table.add("baseline.discovery_association_m", p.discovery_association_m, {0.001, 100.0}, "m",
            "[delta] Sightings of a new landmark this near to each other are one.");
  table.add("baseline.max_newest_pose_error", p.max_newest_pose_error, {0.0, 1e12}, "",
            "Error of the newest pose beyond which the update is rolled back.");
}

void describe_evidence(SmoothingMapperParameters& p, bus::ParameterTable& table) {
  table.add("smoothing.relinearise_above", p.relinearise_above, {1e-6, 1.0}, "sigma",
            "A measurement is linearised again beyond this: 1e-4 on long open roads.");
  table.add("smoothing.gate_sigmas", p.gate_sigmas, {0.1, 100.0}, "sigma", "Association gate.");
  table.add("smoothing.gate_floor_m", p.gate_floor_m, {0.0, 10.0}, "m", "Added to the gate.");
  table.add("smoothing.predicted_sigma_m", p.predicted_sigma_m, {1e-4, 100.0}, "m",
            "Of a predicted pose that no odometry made.");
  table.add("smoothing.predicted_sigma_rad", p.predicted_sigma_rad, {1e-5, 3.2}, "rad",
            "Of the heading of a predicted pose that no odometry made.");
  table.add("smoothing.filter_disagreement_m", p.filter_disagreement_m, {0.0, 100.0}, "m",
            "a keyframe with at most two landmarks that moves so much otherwise than the filter "
            "is not believed; 0: the filter is not asked");
  table.add("smoothing.min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
            "Of what can be matched: below, a predicted pose is not believed.");
  table.add("smoothing.correlated_share", p.correlated_share, {0.0, 0.9}, "",
            "Of a sighting's variance: what stays the same over lasting_m; 0 = all is new.");
  table.add("smoothing.correlation_m", p.correlation_m, {0.01, 1000.0}, "m",
            "Way over which what lasts of a sighting's error fades.");
  table.add("smoothing.stationary_share", p.stationary_share, {0.0, 1.0}, "",
            "Of a sighting's variance: what stays the same while the vehicle stands.");
  table.add("smoothing.scale_sigma", p.scale_sigma, {0.0, 0.1}, "",
            "Of distances, the same for all landmarks and for ever: told in covariances.");
  table.add("smoothing.start_heading_sigma_rad", p.start_heading_sigma_rad, {1e-5, 10.0}, "rad",
            "A map begins with a keyframe whose ends the odometry ties to so much heading...");
  table.add("smoothing.start_wait_s", p.start_wait_s, {0.0, 60.0}, "s",
            "... or, after so long, with any.");
  table.add("smoothing.min_matched", p.min_matched, {1, 1000}, "",
            "Fewest matches of a pose that odometry does not support.");
  table.add("smoothing.outlier_chi2", p.outlier_chi2, {1.0, 1e6}, "",
            "Of one association after the update (2 degrees of freedom): it is taken out.");
  table.add("smoothing.max_innovation_sigmas", p.max_innovation_sigmas, {1.0, 1e6}, "sigma",
            "chi^2 of all associations as a normal deviate: beyond, the update is rolled back.");
}

void describe_growth(SmoothingMapperParameters& p, bus::ParameterTable& table) {
  table.add("smoothing.use_odometry", p.use_odometry, "ODOMETRY between keyframes as a factor.");
  table.add("smoothing.gyro_walk", p.gyro_walk, {0.0, 1.0}, "rad/s/sqrt(s)",
            "Random walk of the gyro's bias in the graph; 0 = the filter's word is taken for it.");
  table.add("smoothing.localisation_only", p.localisation_only,
            "Never change the map that was given.");
  table.add("smoothing.recent_keyframes", p.recent_keyframes, {1, 100000}, "keyframes",
            "Landmarks seen within so many share their error with the pose.");
  table.add("smoothing.min_observations", p.min_observations, {1, 1000}, "",
            "A landmark enters the map when it was detected so often.");
  table.add("smoothing.min_observation_ratio", p.min_observation_ratio, {0.0, 1.0}, "",
            "... and in this share of the scans that had it in view.");
  table.add("smoothing.candidate_keyframes", p.candidate_keyframes, {1, 100000}, "keyframes",
            "A candidate seen too seldom is forgotten after so many.");
  table.add("smoothing.merge_distance_m", p.merge_distance_m, {0.0, 100.0}, "m",
            "Two landmarks this near that were never seen from one place are one.");
  table.add("smoothing.fold_distance_m", p.fold_distance_m, {0.0, 100.0}, "m",
            "A keyframe this near to an earlier one and similarly turned is folded into it.");
  table.add("smoothing.fold_angle_rad", p.fold_angle_rad, {0.0, 3.2}, "rad",
            "How similarly turned.");
  table.add("smoothing.given_map_sigma_m", p.given_map_sigma_m, {1e-4, 100.0}, "m",
            "Of the landmarks of a given map that states no covariance.");
}

void describe_renamed(bus::ParameterTable& table) {
  table.renamed("source.", "baseline.");
  table.renamed("ours.", "smoothing.");
  table.renamed("ours.lasting_share", "smoothing.correlated_share");
  table.renamed("ours.lasting_m", "smoothing.correlation_m");
  table.renamed("ours.standing_share", "smoothing.stationary_share");
  table.renamed("ours.min_sightings", "smoothing.min_observations");
  table.renamed("ours.min_sighting_ratio", "smoothing.min_observation_ratio");
  table.renamed_choice("method", "source", "baseline");
  table.renamed_choice("method", "ours", "smoothing");
}

}  // namespace

void describe(MapperParameters& parameters, bus::ParameterTable& table) {
  table.add("method", parameters.method, {"smoothing", "baseline"},
            "smoothing: this project's; baseline: as the GeoSLAM thesis describes it.");
  describe_evidence(parameters.smoothing, table);
  describe_growth(parameters.smoothing, table);
  describe_baseline(parameters.baseline, table);
  describe_renamed(table);
}

void describe(MapperOutputParameters& parameters, bus::ParameterTable& table) {
  table.add("output.map_period_s", parameters.map_period_s, {0.05, 3600.0}, "s",
            "MAP is published at most this often (message time), where it has changed.");
  table.add("output.moved_m", parameters.moved_m, {0.0, 10.0}, "m",
            "MAP_DELTA leaves out landmarks that moved less since they were last in it.");
  table.add("output.reset_distance_m", parameters.reset_distance_m, {0.001, 1000.0}, "m",
            "SLAM_POSE counts a reset where the pose jumps farther ...");
  table.add("output.reset_angle_rad", parameters.reset_angle_rad, {0.001, 3.2}, "rad",
            "... or turns more than this against its prediction.");
}

}  // namespace understory::geoslam_mapper
