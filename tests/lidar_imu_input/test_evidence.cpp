// What the vehicle's wheels exclude, and what its velocity says of a standstill: each part alone.
#include "services/lidar_imu_input/stationary_monitor.hpp"
#include "services/lidar_imu_input/vehicle_constraints.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;

namespace {

model::ImuSample sample_at(double time_s, const Eigen::Vector3d& rate_rad_s) {
  model::ImuSample sample;
  sample.utime = static_cast<model::Utime>(1e6 * time_s);
  sample.angular_rate_rad_s = rate_rad_s;
  sample.specific_force_mps2 << 0.0, 0.0, kGravity_mps2;
  return sample;
}

}  // namespace

TEST_CASE("An axle that cannot slip does not, wherever it is mounted", "[lidar_imu_input]") {
  ConstraintParameters parameters;
  parameters.side_slip_mps = parameters.vertical_mps = 1e-4;
  parameters.side_slip_scale = parameters.vertical_scale = 0.0;
  for (const geometry::SE2& vehicle_T_axle :
       {geometry::SE2(0.0, 0.0, 0.0), geometry::SE2(-1.5, 0.0, 0.0), geometry::SE2(-1.5, 0.2, 0.3),
        geometry::SE2(2.0, -0.4, -2.0)}) {
    CarGeometry car;
    car.axle_T_vehicle = vehicle_T_axle.inverse();
    const model::ImuSample sample = sample_at(50.0, {0.1, -0.2, 0.5});
    AttitudeFilter attitude(ImuParameters{}, sample.specific_force_mps2);
    DeadReckoning reckoning(ImuParameters{});

    VehicleConstraints constraints(parameters, car);
    constraints.apply(sample, sample.angular_rate_rad_s.z(), true, attitude, reckoning);

    // The axle's velocity as both now have it.
    const Eigen::Vector2d at = vehicle_T_axle.translation();
    const Eigen::Vector2d left =
        vehicle_T_axle * Eigen::Vector2d(0.0, 1.0) - vehicle_T_axle * Eigen::Vector2d::Zero();
    const Eigen::Vector3d rate = sample.angular_rate_rad_s - attitude.gyro_bias();
    const Eigen::Vector3d in_space =
        attitude.velocity() + rate.cross(Eigen::Vector3d(at.x(), at.y(), 0.0));
    CHECK(std::abs(in_space.head<2>().dot(left)) < 1e-3);
    CHECK(std::abs(in_space.z()) < 1e-3);
    const double yaw_rate = sample.angular_rate_rad_s.z() - reckoning.bias()(0);
    const Eigen::Vector2d in_plane =
        reckoning.velocity() + yaw_rate * Eigen::Vector2d(-at.y(), at.x());
    CHECK(std::abs(in_plane.dot(left)) < 1e-3);
  }
}

TEST_CASE("A velocity that denies a standstill is overruled after ten seconds without a break",
          "[lidar_imu_input]") {
  StationaryMonitor monitor(StandstillParameters{}, ImuParameters{});
  double now_s = 100.0;
  // Quiet samples for so long; how long of that it was found stationary.
  const auto stationary_s = [&](double for_s, double speed_mps) {
    VelocityEvidence velocity;
    velocity.velocity_mps.x() = speed_mps;
    velocity.covariance_m2ps2 = 1e-4 * Eigen::Matrix2d::Identity();
    int found = 0;
    for (const double end_s = now_s + for_s; now_s < end_s; now_s += 0.01) {
      monitor.add(sample_at(now_s, Eigen::Vector3d::Zero()), 0.01, Eigen::Vector3d::Zero(),
                  velocity);
      found += monitor.is_stationary() ? 1 : 0;
    }
    return 0.01 * found;
  };

  monitor.begin_at(static_cast<model::Utime>(1e6 * now_s));
  CHECK(stationary_s(6.0, 1.0) == 0.0);
  CHECK(stationary_s(2.0, 0.0) == Approx(2.0).margin(0.02));
  CHECK(stationary_s(9.9, 1.0) == 0.0);
  CHECK(stationary_s(2.1, 1.0) == Approx(2.0).margin(0.05));
}
