// The filter's parameters. Ranges: adapter_parameters.cpp.
#pragma once

#include <string>

namespace understory::ekf {

/// Prior knowledge of the vehicle's motion and the inertial sensors.
struct EkfPriorParameters {
  double velocity_sigma_mps = 5.0;         ///< Per axis, while the vehicle may move.
  double gyro_bias_sigma = 0.005;          ///< [rad/s]
  double accelerometer_bias_sigma = 0.15;  ///< [m/s^2], the level's error included.
  /// With an IMU the map begins when the vehicle is stationary, or moves by its wheels, but after
  /// this time at the latest.
  double wait_s = 1.0;
};

/// Noise of the motion.
struct EkfMotionParameters {
  double gyro_walk = 1e-5;             ///< [rad/s/sqrt(s)] Random walk of the bias.
  double accelerometer_walk = 1e-3;    ///< [m/s^2/sqrt(s)] Random walk of the bias.
  double stationary_sigma_mps = 0.01;  ///< Of the velocity of a stationary vehicle.
  /// Of the body's sway about the place where it is parked (engine, wind), per axis. It does not
  /// grow with time.
  double stationary_sigma_m = 2e-4;
  double stationary_sigma_rad = 3e-5;  ///< The same of the heading.
  /// Likewise the heading.
  double sideways_sigma_mps = 0.0;
  double gap_acceleration = 2.0;  ///< [m/s^2/sqrt(Hz)] White acceleration without odometry.
  double gap_yaw_rate = 0.5;      ///< [rad/s] Yaw rate without odometry.
  /// Change of speed within an increment of wheel odometry [m/s^2].
  double wheel_acceleration = 2.0;
};

/// Landmarks of the active state.
struct EkfMapParameters {
  int max_landmarks = 150;        ///< Capacity.
  double min_separation_m = 0.6;  ///< A new landmark within this distance of an old one is refused.
  double keep_range_factor = 1.2;  ///< Landmarks beyond this multiple of the range are removed.
  int max_missed = 100;            ///< Consecutive scans with it in view that did not observe it.
  int max_refused = 5;             ///< Consecutive refusals by its gate: it is removed.
};

/// Errors that the observations of consecutive scans share: a trunk is no exact circle, and the
/// beams hit the same side of it. From one place they do not average out.
struct EkfObservationParameters {
  /// Share of an observation's variance that is correlated from scan to scan; 0 = white noise.
  double correlated_share = 0.05;
  /// Distance driven over which the correlation falls to 1/e.
  double correlation_m = 20.0;
  /// Standard deviation of a constant scale error of all distances (the laser's scale; trunks that
  /// appear nearer the farther they are). The whole map is too large or small by it.
  double scale_sigma = 1e-4;
};

/// Gates against wrong pairings.
struct EkfGateParameters {
  double landmark_probability = 0.999;  ///< chi^2 gate of each landmark.
  double set_probability = 0.999;       ///< chi^2 gate of all landmarks of a scan together.
  double rejoin_probability = 0.99;  ///< Joint compatibility with landmarks whose track was lost.
  int rejoin_after_scans = 3;        ///< Scans without an observation after which a track is lost.
  /// Lost landmarks with a wider gate are not searched: the gate would accept anything.
  double rejoin_max_gate_m = 20.0;
  int rejoin_max_nodes = 20000;  ///< Of the searches of one scan.
};

/// When and how the filter starts again.
struct EkfRestartParameters {
  int after_refused_scans = 10;  ///< Consecutive scans of which most landmarks were refused.
  double sigma_m = 2.0;          ///< Added to the uncertainty of the position, per axis.
  double sigma_rad = 0.2;        ///< Added to the uncertainty of the heading.
  double max_gap_s = 10.0;       ///< Longest interval without odometry and scans.
  /// A longer one is announced as a restart, even if the map is kept.
  double announced_gap_s = 1.5;
  double clock_jump_s = 10.0;  ///< A stamp earlier by more than this resets the clock.
};

/// All parameters of the stage.
struct EkfParameters {
  /// "right_invariant", "first_estimate" or "plain": definition of the errors (ErrorForm).
  std::string error_form = "right_invariant";
  /// Longest time that odometry waits for the scan at its end.
  double max_scan_delay_s = 0.4;
  int max_detections = 2000;  ///< Of one TRACKED_LANDMARKS message.
  EkfPriorParameters prior;
  EkfMotionParameters motion;
  EkfMapParameters map;
  EkfObservationParameters observation;
  EkfGateParameters gate;
  EkfRestartParameters restart;
};

}  // namespace understory::ekf
