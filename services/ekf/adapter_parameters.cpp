#include "services/ekf/adapter_parameters.hpp"

namespace understory::ekf {
namespace {

void describe(EkfPriorParameters& p, bus::ParameterTable& table) {
  table.add("prior.velocity_sigma_mps", p.velocity_sigma_mps, {0.001, 100.0}, "m/s",
            "Standard deviation of the velocity before the first measurement, per axis.");
  table.add("prior.gyro_bias_sigma", p.gyro_bias_sigma, {1e-7, 1.0}, "rad/s",
            "Standard deviation of the gyro's bias before the first measurement.");
  table.add(
      "prior.accelerometer_bias_sigma", p.accelerometer_bias_sigma, {1e-6, 10.0}, "m/s^2",
      "Standard deviation of the accelerometer's bias before the first measurement, the level's "
      "error included.");
  table.add("prior.wait_s", p.wait_s, {0.0, 60.0}, "s",
            "With an IMU the map begins when the vehicle is known to be stationary, or its wheels "
            "move, and after this time at the latest.");
}

void describe(EkfMotionParameters& p, bus::ParameterTable& table) {
  table.add("motion.gyro_walk", p.gyro_walk, {0.0, 0.1}, "rad/s/sqrt(s)",
            "Random walk of the gyro's bias.");
  table.add("motion.accelerometer_walk", p.accelerometer_walk, {0.0, 1.0}, "m/s^2/sqrt(s)",
            "Random walk of the accelerometer's bias.");
  table.add("motion.stationary_sigma_mps", p.stationary_sigma_mps, {1e-5, 1.0}, "m/s",
            "Standard deviation of the velocity of a stationary vehicle.");
  table.add("motion.stationary_sigma_m", p.stationary_sigma_m, {1e-6, 1.0}, "m",
            "Standard deviation of the position of the parked body (sway), per axis.");
  table.add("motion.stationary_sigma_rad", p.stationary_sigma_rad, {1e-7, 0.1}, "rad",
            "Standard deviation of the heading of the parked body (sway).");
  table.add(
      "motion.sideways_sigma_mps", p.sideways_sigma_mps, {0.0, 100.0}, "m/s",
      "Standard deviation of the velocity across the vehicle, per odometry increment; 0 = it may "
      "slide freely.");
  table.add("motion.gap_acceleration", p.gap_acceleration, {0.01, 100.0}, "m/s^2/sqrt(Hz)",
            "White acceleration in intervals without odometry.");
  table.add("motion.gap_yaw_rate", p.gap_yaw_rate, {0.001, 10.0}, "rad/s",
            "Yaw rate in intervals without odometry.");
  table.add("motion.wheel_acceleration", p.wheel_acceleration, {0.01, 100.0}, "m/s^2",
            "Change of speed within an increment of wheel odometry.");
}

void describe(EkfMapParameters& p, bus::ParameterTable& table) {
  table.add("map.max_landmarks", p.max_landmarks, {1, 1000}, "", "Capacity of the active state.");
  table.add("map.min_separation_m", p.min_separation_m, {0.0, 10.0}, "m",
            "A new landmark nearer to an old one is refused.");
  table.add("map.keep_range_factor", p.keep_range_factor, {1.0, 10.0}, "of the range",
            "Landmarks farther than this times the sensor's range leave the active state.");
  table.add("map.max_missed", p.max_missed, {1, 1000000}, "scans",
            "A landmark leaves after this many consecutive scans that should have observed it and "
            "did not.");
  table.add("map.max_refused", p.max_refused, {1, 1000000}, "scans",
            "A landmark leaves after this many consecutive scans in which its gate refused it.");
}

void describe(EkfObservationParameters& p, bus::ParameterTable& table) {
  table.add(
      "observation.correlated_share", p.correlated_share, {0.0, 0.9}, "",
      "Share of an observation's variance that is correlated from scan to scan; 0 = white noise.");
  table.add("observation.correlation_m", p.correlation_m, {0.01, 1000.0}, "m",
            "Distance driven over which that correlation falls to 1/e.");
  table.add("observation.scale_sigma", p.scale_sigma, {0.0, 0.1}, "",
            "Standard deviation of a constant scale error of all distances.");
}

void describe(EkfGateParameters& p, bus::ParameterTable& table) {
  table.add("gate.landmark_probability", p.landmark_probability, {0.5, 0.999999}, "",
            "chi^2 gate of each landmark.");
  table.add("gate.set_probability", p.set_probability, {0.5, 0.999999}, "",
            "chi^2 gate of a scan's landmarks together.");
  table.add("gate.rejoin_probability", p.rejoin_probability, {0.5, 0.999999}, "",
            "Joint compatibility of new tracks with landmarks whose track was lost.");
  table.add("gate.rejoin_after_scans", p.rejoin_after_scans, {1, 10000}, "scans",
            "Scans without an observation after which a landmark may take a new track.");
  table.add("gate.rejoin_max_gate_m", p.rejoin_max_gate_m, {0.1, 100.0}, "m",
            "A lost landmark whose gate is wider takes no new track.");
  table.add("gate.rejoin_max_nodes", p.rejoin_max_nodes, {1, 1000000}, "",
            "Nodes of the searches of one scan for the largest compatible set.");
}

void describe(EkfRestartParameters& p, bus::ParameterTable& table) {
  table.add(
      "restart.after_refused_scans", p.after_refused_scans, {1, 100000}, "scans",
      "Consecutive scans of which most landmarks were refused, after which the filter restarts.");
  table.add("restart.sigma_m", p.sigma_m, {0.0, 1000.0}, "m",
            "Added to the standard deviation of the position at a restart.");
  table.add("restart.sigma_rad", p.sigma_rad, {0.0, 3.2}, "rad",
            "Added to the standard deviation of the heading at a restart.");
  table.add("restart.max_gap_s", p.max_gap_s, {0.1, 1000.0}, "s",
            "Longest interval without odometry and scans; after a longer one the filter restarts.");
  table.add(
      "restart.announced_gap_s", p.announced_gap_s, {0.1, 1000.0}, "s",
      "A longer interval without odometry and scans is announced as a restart, also where the "
      "map is kept.");
  table.add("restart.clock_jump_s", p.clock_jump_s, {0.1, 1e6}, "s",
            "A stamp that is earlier than the latest one by more than this restarts the clock.");
}

}  // namespace

void describe(EkfParameters& parameters, bus::ParameterTable& table) {
  table.add("error_form", parameters.error_form, {"right_invariant", "first_estimate", "plain"},
            "Form of the error state; plain underestimates the covariance of the heading.");
  table.add("max_scan_delay_s", parameters.max_scan_delay_s, {0.0, 10.0}, "s",
            "Longest time that odometry waits for the scan at its end.");
  table.add("input.max_detections", parameters.max_detections, {1, 1000000}, "",
            "TRACKED_LANDMARKS with more detections is refused and counted (too_large): this "
            "bounds the cost of a message. A laser of 2048 columns cannot show 700 trunks.");
  describe(parameters.prior, table);
  describe(parameters.motion, table);
  describe(parameters.map, table);
  describe(parameters.observation, table);
  describe(parameters.gate, table);
  describe(parameters.restart, table);
  table.renamed("sighting.lasting_share", "observation.correlated_share");
  table.renamed("sighting.lasting_m", "observation.correlation_m");
  table.renamed("sighting.", "observation.");
  table.renamed("motion.standing_sigma_mps", "motion.stationary_sigma_mps");
  table.renamed("motion.standing_sigma_m", "motion.stationary_sigma_m");
  table.renamed("motion.standing_sigma_rad", "motion.stationary_sigma_rad");
}

}  // namespace understory::ekf
