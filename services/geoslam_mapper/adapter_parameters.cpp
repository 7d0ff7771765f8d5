#include "services/geoslam_mapper/adapter_parameters.hpp"

namespace understory::geoslam_mapper {
namespace {

void describe_evidence(SmoothingMapperParameters& p, bus::ParameterTable& table) {
  table.add("smoothing.use_odometry", p.use_odometry,
            "Use ODOMETRY between keyframes as a measurement.");
  table.add("smoothing.gyro_walk", p.gyro_walk, {0.0, 1.0}, "rad/s/sqrt(s)",
            "Random walk of the gyro's bias, which is estimated in the graph and so corrects the "
            "earlier path, too. 0: the bias of ODOMETRY is used unchanged.");
  table.add("smoothing.gyro_start_sigma", p.gyro_start_sigma, {1e-6, 1.0}, "rad/s",
            "Standard deviation of the gyro bias that ODOMETRY subtracts, before the first stop.");
  table.add("smoothing.predicted_sigma_m", p.predicted_sigma_m, {1e-4, 100.0}, "m",
            "Standard deviation of a pose that was predicted without odometry.");
  table.add("smoothing.predicted_sigma_rad", p.predicted_sigma_rad, {1e-5, 3.2}, "rad",
            "Standard deviation of its heading.");

  table.add("smoothing.correlated_share", p.correlated_share, {0.0, 0.9}, "",
            "Share of an observation's variance that is correlated along the path (a trunk is not "
            "round: from one place its error is the same). 0: white noise.");
  table.add("smoothing.correlation_m", p.correlation_m, {0.01, 1000.0}, "m",
            "Distance over which that correlation falls to 1/e.");
  table.add("smoothing.stationary_share", p.stationary_share, {0.0, 1.0}, "",
            "The same share while the vehicle is stationary: the beams hit the same bark again.");
  table.add("smoothing.scale_sigma", p.scale_sigma, {0.0, 0.1}, "",
            "Standard deviation of the scale of distances, a common-mode error of all landmarks. "
            "It is estimated from odometry and the map is corrected; the rest is in the "
            "covariances. 0: no such error.");
  table.add("smoothing.odometry_scale_sigma", p.odometry_scale_sigma, {0.0, 0.1}, "",
            "Standard deviation of the scale of odometry's distances, in addition to its "
            "covariance. 0: none.");
  table.add("smoothing.given_map_sigma_m", p.given_map_sigma_m, {1e-4, 100.0}, "m",
            "Standard deviation of the landmarks of a given map without covariances; the least "
            "one, next to its keyframes, of a map from a drive.");
}

void describe_association(SmoothingMapperParameters& p, bus::ParameterTable& table) {
  table.add("smoothing.gate_sigmas", p.gate_sigmas, {0.1, 100.0}, "sigma",
            "Half width of the association gate.");
  table.add("smoothing.gate_floor_m", p.gate_floor_m, {0.0, 10.0}, "m",
            "Added to the half width of the gate.");
  table.add("smoothing.min_matched_ratio", p.min_matched_ratio, {0.0, 1.0}, "",
            "Smallest share of matches among the landmarks that could match. With fewer the "
            "predicted pose is rejected and the whole map is searched.");
  table.add("smoothing.min_matched", p.min_matched, {1, 1000}, "",
            "Fewest matches of a pose that odometry does not support.");

  table.add("smoothing.filter_disagreement_m", p.filter_disagreement_m, {0.0, 100.0}, "m",
            "A keyframe with at most two matches is refused where its motion differs from the "
            "filter's by more than this: the trunk may be a pedestrian. 0: no such test.");
  table.add("smoothing.recent_keyframes", p.recent_keyframes, {1, 100000}, "keyframes",
            "Landmarks observed within this many keyframes share the error of the pose.");
  table.add(
      "smoothing.outlier_chi2", p.outlier_chi2, {1.0, 1e6}, "",
      "An association with a larger chi^2 after the update (2 degrees of freedom) is removed.");
  table.add("smoothing.max_innovation_sigmas", p.max_innovation_sigmas, {1.0, 1e6}, "sigma",
            "Largest chi^2 of all associations, as a normal deviate; above it the update is rolled "
            "back.");
}

void describe_cuts(SmoothingMapperParameters& p, bus::ParameterTable& table) {
  table.add("smoothing.cut_sparse", p.cut_sparse, {0.0, 1000.0}, "landmarks",
            "A stretch of condense_m continues until fewer landmarks than this are observed, "
            "averaged over 16 scans. 0: no such rule. Of several rules any one ends it.");
  table.add("smoothing.cut_dense", p.cut_dense, {0.0, 1000.0}, "landmarks",
            "... or until more than this are observed. 0: no such rule.");
  table.add("smoothing.cut_turn_rad", p.cut_turn_rad, {0.0, 3.1}, "rad",
            "... or until the heading has changed by this much within 15 m. 0: no such rule.");
  table.add("smoothing.cut_longest_m", p.cut_longest_m, {1.0, 100000.0}, "m",
            "... but not longer than this, or condense_m if that is more.");
  table.add(
      "smoothing.cut_size", p.cut_size, {0, 100000}, "",
      "A stretch of any length ends at this number of nodes plus landmarks. 0: no such rule.");
}

void describe_growth(SmoothingMapperParameters& p, bus::ParameterTable& table) {
  table.add("smoothing.localisation_only", p.localisation_only, "Never change the given map.");
  table.add("smoothing.start_heading_sigma_rad", p.start_heading_sigma_rad, {1e-5, 10.0}, "rad",
            "A map starts with a keyframe whose rotation odometry knows to this sigma (before, the "
            "gyro's bias is unknown) ...");
  table.add("smoothing.start_wait_s", p.start_wait_s, {0.0, 60.0}, "s",
            "... or, after this time, with any keyframe.");
  table.add("smoothing.new_map_keyframes", p.new_map_keyframes, {0, 1000}, "keyframes",
            "A map is accepted when this many keyframes agree with each other; until then another "
            "map with as many replaces it. When lost, start a new map after this many consecutive "
            "keyframes; the old map is kept. 0: the first keyframe is accepted, and a lost vehicle "
            "waits for the old map. 1: every keyframe of a lost vehicle starts a map.");
  table.add("smoothing.lost_sigma_m", p.lost_sigma_m, {0.01, 10000.0}, "m",
            "A keyframe without a certain pose is lost where odometry since the last certain one "
            "has a gap, or is less certain than this (standard deviation of the position) ...");
  table.add("smoothing.lost_sigma_rad", p.lost_sigma_rad, {0.001, 3.2}, "rad",
            "... or than this (of the heading).");

  table.add("smoothing.min_observations", p.min_observations, {1, 1000}, "scans",
            "A landmark enters the map when this many scans detected it ...");
  table.add("smoothing.min_observation_ratio", p.min_observation_ratio, {0.0, 1.0}, "",
            "... and in this share of the scans that had it in view.");
  table.add("smoothing.candidate_keyframes", p.candidate_keyframes, {1, 100000}, "keyframes",
            "A candidate for the map is dropped after this many keyframes.");
  table.add("smoothing.merge_distance_m", p.merge_distance_m, {0.0, 100.0}, "m",
            "Search radius for doubles of a landmark. They are merged if their joint covariance, "
            "the keyframes that saw both and the landmarks around allow it.");
  table.add("smoothing.fold_distance_m", p.fold_distance_m, {0.0, 100.0}, "m",
            "A keyframe this near to an earlier one, with a similar heading, is merged into it.");
  table.add("smoothing.fold_angle_rad", p.fold_angle_rad, {0.0, 3.2}, "rad",
            "Largest difference of their headings.");
  table.add("smoothing.known_ground_m", p.known_ground_m, {0.0, 100.0}, "m",
            "Observations of a keyframe this near to one of an earlier pass with half of its "
            "landmarks are added to that one some keyframes later: the map's size depends on the "
            "area, not on the time. 0: every keyframe is kept.");
  table.add("smoothing.condense_m", p.condense_m, {0.0, 1000.0}, "m",
            "The keyframes of this path length, at least four, become one condensed measurement. "
            "0: none.");
  table.add(
      "smoothing.condense_of_range", p.condense_of_range, {0.0, 1000.0}, "",
      "... but at most this multiple of the sensor's range: bends within a stretch are lost.");
  table.add(
      "smoothing.condense_after_m", p.condense_after_m, {0.0, 10000.0}, "m",
      "... once the vehicle is so far beyond it, and the stretch is compared with known ground.");
  describe_cuts(p, table);
  table.add("smoothing.hand_over_m", p.hand_over_m, {0.0, 100000.0}, "m",
            "Condensed measurements farther from the vehicle than this are handed over to "
            "submap_store with their landmarks and keyframes, and come back before the vehicle is "
            "near: memory depends on the area around the vehicle. More is kept if the pose is "
            "uncertain. 0: the whole map is kept.");
}

void describe_old_keys(bus::ParameterTable& table) {
  table.renamed("ours.", "smoothing.");
  table.renamed("ours.lasting_share", "smoothing.correlated_share");
  table.renamed("ours.lasting_m", "smoothing.correlation_m");
  table.renamed("ours.standing_share", "smoothing.stationary_share");
  table.renamed("ours.min_sightings", "smoothing.min_observations");
  table.renamed("ours.min_sighting_ratio", "smoothing.min_observation_ratio");
  // Earlier versions could choose the method of the thesis.
  const std::string where = "the method of the GeoSLAM thesis runs in understory eval alone";
  table.removed("method", "the mapper has one method now; " + where);
  table.removed("baseline.", where);
  table.removed("source.", where);
}

}  // namespace

void describe(SmoothingMapperParameters& parameters, bus::ParameterTable& table) {
  describe_evidence(parameters, table);
  describe_association(parameters, table);
  describe_growth(parameters, table);
  describe_old_keys(table);
}

void describe(MapperInputParameters& parameters, bus::ParameterTable& table) {
  table.add("input.map_file", parameters.map_file, {},
            "Map file (GeoPackage, see understory map) to begin with; relative to the folder in "
            "which the process was started. With smoothing.localisation_only it is not changed; "
            "else it grows. Empty: a new map. A saved state has priority.");
  table.add("input.map_id", parameters.map_id, {0, 32767}, "",
            "Number of the map in that file. 0: the only one that has landmarks.");
  table.add("input.max_detections", parameters.max_detections, {1, 1000000}, "",
            "LANDMARKS with more detections is refused and counted (too_large): this bounds the "
            "cost of a message. A laser of 2048 columns cannot show 700 trunks.");
  table.add(
      "input.max_keyframe_landmarks", parameters.max_keyframe_landmarks, {1, 1000000}, "",
      "The same for the landmarks of a KEYFRAME; members beyond 64 use the bytes of landmarks.");
  table.add("input.max_given_landmarks", parameters.max_given_landmarks, {1, 10000000}, "",
            "The same for the landmarks of a GIVEN_MAP.");
}

void describe(MapperOutputParameters& parameters, bus::ParameterTable& table) {
  table.add("output.map_period_s", parameters.map_period_s, {0.05, 3600.0}, "s",
            "Without a request MAP is published at most this often (message time), where the map "
            "has changed ...");
  table.add("output.map_share", parameters.map_share, {0.0, 0.9}, "",
            "... and so rarely that its bytes stay below this share of all bytes of the mapper. A "
            "map that starts, or jumps by more than output.reset_distance_m, may send one MAP in "
            "advance. 0: only then, on request and at the end.");
  table.add("output.moved_m", parameters.moved_m, {0.0, 10.0}, "m",
            "MAP_DELTA leaves out landmarks that moved by less than this since they were last in "
            "it, or by less than a quarter of their standard deviation and 2 cm (10 cm farther "
            "than 60 m from the vehicle).");
  table.add("output.reset_distance_m", parameters.reset_distance_m, {0.001, 1000.0}, "m",
            "SLAM_POSE counts a reset if the pose jumps by more than this ...");
  table.add("output.reset_angle_rad", parameters.reset_angle_rad, {0.001, 3.2}, "rad",
            "... or rotates more than this against its prediction.");
  table.add("output.oldest_pose_s", parameters.oldest_pose_s, {0.0, 3600.0}, "s",
            "Scans whose pose came only with their keyframe, this much later than the newest scan, "
            "get no SLAM_POSE: a controller would take it for the present pose.");
}

}  // namespace understory::geoslam_mapper
