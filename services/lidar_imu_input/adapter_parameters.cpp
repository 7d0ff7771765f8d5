#include "services/lidar_imu_input/adapter_parameters.hpp"

namespace understory::lidar_imu_input {
namespace {

void describe_mount(SensorMount& mount, const std::string& name, bus::ParameterTable& table) {
  table.add(name + ".x_m", mount.x_m, {-50.0, 50.0}, "m", "Forward of the vehicle's origin.");
  table.add(name + ".y_m", mount.y_m, {-50.0, 50.0}, "m", "Left of it.");
  table.add(name + ".z_m", mount.z_m, {-50.0, 50.0}, "m", "Above it.");
  table.add(name + ".roll_rad", mount.roll_rad, {-3.2, 3.2}, "rad",
            "Rotation about x, applied first.");
  table.add(name + ".pitch_rad", mount.pitch_rad, {-3.2, 3.2}, "rad",
            "Rotation about y, applied second.");
  table.add(name + ".yaw_rad", mount.yaw_rad, {-3.2, 3.2}, "rad",
            "Rotation about z, applied last.");
}

void describe_imu(ImuParameters& p, bus::ParameterTable& table) {
  describe_mount(p.mount, "imu.mount", table);
  table.add("imu.gyro_noise", p.gyro_noise, {1e-7, 1.0}, "rad/s/sqrt(Hz)",
            "White noise of the rate.");
  table.add("imu.force_noise", p.force_noise, {1e-7, 10.0}, "m/s^2/sqrt(Hz)",
            "White noise of the force.");
  table.add("imu.gyro_bias_sigma", p.gyro_bias_sigma, {1e-6, 1.0}, "rad/s",
            "Bias of the rate at the start, sigma.");
  table.add("imu.force_bias_sigma", p.force_bias_sigma, {1e-6, 10.0}, "m/s^2",
            "Bias of the force at the start, sigma.");
  table.add("imu.gyro_bias_walk", p.gyro_bias_walk, {0.0, 1.0}, "rad/s/sqrt(s)",
            "Random walk of the rate's bias.");
  table.add("imu.force_bias_walk", p.force_bias_walk, {0.0, 10.0}, "m/s^2/sqrt(s)",
            "Random walk of the force's bias.");
  table.add("imu.gyro_scale_sigma", p.gyro_scale_sigma, {0.0, 0.5}, "",
            "Relative error of the rate.");
  table.add("imu.level_noise", p.level_noise, {0.0, 10.0}, "m/s^2/sqrt(Hz)",
            "Error of the removed gravity, from errors of the level.");
  table.add("imu.gyro_range_rad_s", p.gyro_range_rad_s, {0.1, 1000.0}, "rad/s",
            "A rate this large is saturated.");
  table.add("imu.force_range_mps2", p.force_range_mps2, {10.0, 10000.0}, "m/s^2",
            "A force this large is saturated.");
  table.add("imu.saturation_gyro_noise", p.saturation_gyro_noise, {0.0, 100.0}, "rad/s/sqrt(Hz)",
            "Noise across saturated samples that were left out.");
  table.add("imu.saturation_force_noise", p.saturation_force_noise, {0.0, 1000.0}, "m/s^2/sqrt(Hz)",
            "Noise across saturated samples that were left out.");
  table.add("imu.max_gap_s", p.max_gap_s, {0.001, 10.0}, "s",
            "Samples farther apart are not joined.");
}

void describe_wheels(WheelOdometryParameters& p, AxlePlace& axle, bus::ParameterTable& table) {
  WheelNoise& n = p.noise;
  table.add("wheels.wheelbase_m", p.car.wheelbase_m, {0.1, 30.0}, "m", "Distance of the axles.");
  table.add("wheels.encoder_left_m", p.car.encoder_left_m, {-5.0, 5.0}, "m",
            "The wheel with the encoder, left of the middle of the rear axle.");
  table.add("wheels.axle_T_vehicle.x_m", axle.x_m, {-50.0, 50.0}, "m",
            "The vehicle's origin, forward of the middle of the rear axle.");
  table.add("wheels.axle_T_vehicle.y_m", axle.y_m, {-50.0, 50.0}, "m", "Left of it.");
  table.add("wheels.axle_T_vehicle.yaw_rad", axle.yaw_rad, {-3.2, 3.2}, "rad", "Rotation about z.");
  table.add("wheels.max_gap_s", p.max_gap_s, {0.001, 10.0}, "s",
            "Longest time for which a sample is used.");
  table.add("wheels.speed_scale_sigma", n.speed_scale_sigma, {0.0, 1.0}, "",
            "Relative error of the speed.");
  table.add("wheels.steering_sigma_rad", n.steering_sigma_rad, {0.0, 1.0}, "rad",
            "Error of the steering's zero.");
  table.add("wheels.steering_scale_sigma", n.steering_scale_sigma, {0.0, 1.0}, "",
            "Relative error of the steering angle.");
  table.add("wheels.side_slip_sigma", n.side_slip_sigma, {0.0, 1.0}, "",
            "Sideways velocity, part of the speed.");
  table.add("wheels.correlation_time_s", n.correlation_time_s, {0.001, 1000.0}, "s",
            "Correlation time of these errors.");
  table.add("wheels.stamp_sigma_s", n.stamp_sigma_s, {0.0, 1.0}, "s",
            "Jitter of an interval's ends.");
  table.add("wheels.standstill_sigma_m", n.standstill_sigma_m, {1e-9, 10.0}, "m/sqrt(s)",
            "Least error of the position.");
  table.add("wheels.standstill_sigma_rad", n.standstill_sigma_rad, {1e-9, 10.0}, "rad/sqrt(s)",
            "Least error of the heading.");
}

void describe_standstill(StandstillParameters& p, bus::ParameterTable& table) {
  table.add("standstill.calibration_s", p.calibration_s, {0.0, 3600.0}, "s",
            "Uninterrupted standstill after which the IMU is calibrated.");
  table.add("standstill.window_s", p.window_s, {0.05, 10.0}, "s",
            "Length of the window of samples.");
  table.add("standstill.gyro_sigma_rad_s", p.gyro_sigma_rad_s, {0.0, 10.0}, "rad/s",
            "Largest spread of the rate in the window.");
  table.add("standstill.force_sigma_mps2", p.force_sigma_mps2, {0.0, 100.0}, "m/s^2",
            "Largest spread of the force in the window.");
  table.add("standstill.gyro_mean_rad_s", p.gyro_mean_rad_s, {0.0, 10.0}, "rad/s",
            "Largest mean rate before the bias is known; then a tenth of it.");
  table.add("standstill.wheel_speed_mps", p.wheel_speed_mps, {0.0, 10.0}, "m/s",
            "Largest speed of the wheels.");
  table.add("standstill.floor_factor", p.floor_factor, {1.0, 1000.0}, "",
            "Largest spread, in units of that at the first standstill.");
  table.add("standstill.velocity_sigma_mps", p.velocity_sigma_mps, {1e-6, 10.0}, "m/s",
            "Velocity at a standstill, sigma.");
}

void describe_constraint(ConstraintParameters& p, bus::ParameterTable& table) {
  table.add("constraint.nonholonomic", p.nonholonomic,
            "Assume that wheels neither slip sideways nor leave the ground.");
  table.add("constraint.side_slip_mps", p.side_slip_mps, {1e-6, 10.0}, "m/s",
            "Sideways velocity of the axle, sigma.");
  table.add("constraint.side_slip_scale", p.side_slip_scale, {0.0, 1.0}, "",
            "The same, part of the speed.");
  table.add("constraint.vertical_mps", p.vertical_mps, {1e-6, 10.0}, "m/s",
            "Velocity across the vehicle's floor, sigma.");
  table.add("constraint.vertical_scale", p.vertical_scale, {0.0, 1.0}, "",
            "The same, part of the speed.");
  table.add("constraint.typical_speed_mps", p.typical_speed_mps, {0.1, 1000.0}, "m/s",
            "Bounds the velocity without wheels.");
  table.add("constraint.wheel_sigma_mps", p.wheel_sigma_mps, {1e-6, 10.0}, "m/s",
            "Wheel speed, as used for the attitude, sigma.");
  table.add("constraint.period_s", p.period_s, {0.001, 10.0}, "s",
            "Time between two uses of the constraints.");
}

void describe_output(OutputParameters& p, bus::ParameterTable& table) {
  table.add("output.max_increment_s", p.max_increment_s, {0.005, 60.0}, "s",
            "Longest increment of ODOMETRY.");
  table.add("output.lag_s", p.lag_s, {0.0, 10.0}, "s",
            "Time that an increment waits for a sweep at its end.");
  table.add("output.max_wait_s", p.max_wait_s, {0.0, 10.0}, "s",
            "Time that a sweep waits for the motion.");
  table.add("output.raw_pose_period_s", p.raw_pose_period_s, {0.0, 10.0}, "s",
            "Time between two RAW_POSE.");
  table.add("output.correction_delay_s", p.correction_delay_s, {0.0, 10.0}, "s",
            "Time from the stamp of a VELOCITY_CORRECTION to its effect.");
  table.add("output.velocity_correlation_s", p.velocity_correlation_s, {0.0, 1000.0}, "s",
            "Correlation time of the error of dead-reckoned velocity.");
}

void describe_fault(FaultParameters& p, bus::ParameterTable& table) {
  table.add("fault.silent_s", p.silent_s, {0.01, 60.0}, "s",
            "Time without a sample after which IMU or wheels are reported.");
  table.add("fault.sweep_silent_s", p.sweep_silent_s, {0.01, 60.0}, "s",
            "Time without a sweep after which lasers are reported.");
  table.add("fault.frozen_s", p.frozen_s, {0.01, 60.0}, "s",
            "Time of identical IMU samples after which the IMU is reported.");
  table.add("fault.clock_jump_s", p.clock_jump_s, {0.01, 60.0}, "s",
            "Stamps are reported if they go back, or lead the others, by more.");
  table.add("fault.resync_samples", p.resync_samples, {2, 1000}, "samples",
            "Regular stamps after which a clock that jumped is followed.");
  table.add("fault.reorder_s", p.reorder_s, {0.0, 0.2}, "s",
            "Time that a sample waits for a missing one before it.");
}

void describe_expected(ExpectedSensors& p, bus::ParameterTable& table) {
  table.add("expected.imu", p.imu, "The vehicle has an IMU: HEALTH is not OK without RAW_IMU.");
  table.add("expected.wheels", p.wheels, "The same for wheels, RAW_WHEELS.");
  table.add("expected.sweep", p.sweep, "The same for a 3-D laser, RAW_SWEEP.");
  table.add("expected.scan", p.scan, "The same for a one-plane laser, RAW_SCAN.");
}

}  // namespace

void describe(LidarImuInputParameters& parameters, AxlePlace& axle_T_vehicle,
              bus::ParameterTable& table) {
  table.add("gnss_aided", parameters.gnss_aided,
            "RAW_POSE takes velocity from GNSS and is a reference, not for mapping.");
  describe_mount(parameters.lidar.mount, "lidar.mount", table);
  table.add("lidar.times_from_azimuth", parameters.lidar.times_from_azimuth,
            {"none", "clockwise", "counterclockwise"},
            "Times for sweeps without times: rotation of the laser, seen from above.");
  table.add("lidar.turns", parameters.lidar.turns, {"any", "clockwise", "counterclockwise"},
            "Rotation of the laser, seen from above in its own frame; \"any\" is not checked.");
  table.add("lidar.revolution_s", parameters.lidar.revolution_s, {0.001, 1.0}, "s",
            "Time of one revolution, for lidar.times_from_azimuth.");
  table.add("lidar.min_range_m", parameters.lidar.min_range_m, {0.0, 100.0}, "m",
            "Nearer points are on the vehicle itself.");
  describe_mount(parameters.planar.mount, "planar.mount", table);
  describe_imu(parameters.imu, table);
  describe_wheels(parameters.wheels, axle_T_vehicle, table);
  describe_standstill(parameters.standstill, table);
  describe_constraint(parameters.constraint, table);
  describe_output(parameters.output, table);
  describe_fault(parameters.fault, table);
  describe_expected(parameters.expected, table);
  table.renamed("lidar.turn_s", "lidar.revolution_s");
  table.renamed("output.max_piece_s", "output.max_increment_s");
}

}  // namespace understory::lidar_imu_input
