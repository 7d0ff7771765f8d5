// The filter's parameters.
#pragma once

#include <string>

namespace understory::ekf {

/// What is known at the start, of the vehicle's motion and of the inertial sensors.
struct EkfPriorParameters {
  double velocity_sigma_mps = 5.0;         ///< Per axis, where the vehicle is not known to stand.
  double gyro_bias_sigma = 0.005;          ///< [rad/s]
  double accelerometer_bias_sigma = 0.15;  ///< [m/s^2] The level's error included.
  /// With an IMU the map begins where the vehicle is found to stand, or to move by its wheels, but
  /// after so long at the latest.
  double wait_s = 1.0;
};

struct EkfMotionParameters {
  double gyro_walk = 1e-5;             ///< [rad/s/sqrt(s)] Random walk of the bias.
  double accelerometer_walk = 1e-3;    ///< [m/s^2/sqrt(s)]
  double stationary_sigma_mps = 0.01;  ///< Of the velocity while the vehicle is found to stand.
  /// The body's sway about the place where it is parked (engine, wind): it does not add up.
  double stationary_sigma_m = 2e-4;  ///< Per axis.
  double stationary_sigma_rad = 3e-5;
  /// Of the velocity across the vehicle, per piece; 0 = it may slide freely.
  double sideways_sigma_mps = 0.0;
  double gap_acceleration = 2.0;  ///< [m/s^2/sqrt(Hz)] Where no odometry tells the motion.
  double gap_yaw_rate = 0.5;      ///< [rad/s] Likewise.
  /// Speed may change so much within a piece of wheel odometry [m/s^2].
  double wheel_acceleration = 2.0;
};

struct EkfMapParameters {
  int max_landmarks = 150;         ///< Of the active state.
  double min_separation_m = 0.6;   ///< A new landmark nearer to an old one is refused.
  double keep_range_factor = 1.2;  ///< Landmarks farther than this times the range leave.
  int max_missed = 100;            ///< Scans in a row that should have shown it and did not.
  int max_refused = 5;             ///< Scans in a row in which its gate refused it: it leaves.
};

/// What errors of sightings have in common from scan to scan: how a trunk is no circle, where the
/// beams meet it. It cannot be averaged out from one place.
struct EkfObservationParameters {
  double correlated_share =
      0.05;                     ///< Of a sighting's variance; 0 = all noise is new in every scan.
  double correlation_m = 20.0;  ///< It fades over so much way.
  /// Of distances, the same for all landmarks and for ever: a laser's scale, trunks that look the
  /// nearer the farther they are. All that is built on sightings is too large or small by it.
  double scale_sigma = 1e-4;
};

struct EkfGateParameters {
  double landmark_probability = 0.999;  ///< chi^2 gate of each landmark.
  double set_probability = 0.999;       ///< chi^2 gate of all of them together.
  double rejoin_probability = 0.99;  ///< Joint compatibility with landmarks whose track was lost.
  int rejoin_after_scans = 3;  ///< Only landmarks not seen for so many scans take a new track.
  /// Nor such whose place is less certain than this: a gate so wide takes anything.
  double rejoin_max_gate_m = 20.0;
  int rejoin_max_nodes = 20000;  ///< Of the search for the largest compatible set.
};

struct EkfRestartParameters {
  int after_refused_scans = 10;  ///< Scans in a row of which most landmarks were refused.
  double sigma_m = 2.0;          ///< Added to the pose's uncertainty at a restart.
  double sigma_rad = 0.2;
  double max_gap_s = 10.0;     ///< Without odometry and scans, after which the way is lost.
  double clock_jump_s = 10.0;  ///< A stamp so far back starts the clock anew.
};

struct EkfParameters {
  /// "right_invariant", "first_estimate" or "plain": how errors are measured (README).
  std::string error_form = "right_invariant";
  /// Odometry waits so long at most for the scan that belongs before it.
  double max_scan_delay_s = 0.4;
  EkfPriorParameters prior;
  EkfMotionParameters motion;
  EkfMapParameters map;
  EkfObservationParameters observation;
  EkfGateParameters gate;
  EkfRestartParameters restart;
};

}  // namespace understory::ekf
