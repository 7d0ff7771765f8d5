// A laser alone: its sweeps are de-skewed by how the filter moves.
#include <cmath>
#include <random>

#include "services/lidar_imu_input/lidar_imu_input.hpp"
#include "tests/catch.hpp"
#include "tests/lidar_imu_input/simulated_vehicle.hpp"

using namespace understory;
using namespace understory::lidar_imu_input;
using namespace understory::test;

namespace {

constexpr model::Utime kBegin = 40'000'000;
constexpr model::Utime kRevolution_us = 100'000;

class LaserAlone {
 public:
  LaserAlone() : track_(level_drive(), 50.0), input_(test::parameters_for_drive()) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> place(-40.0, 40.0);
    for (int i = 0; i < 200; ++i) {
      const double x = place(random);
      world_.emplace_back(x, place(random), 0.0);
    }
    // Its time is not believed before the second revolution.
    for (int k = 2; k > 0; --k)
      input_.add(sweep_at(track_, kBegin - k * kRevolution_us,
                          test::parameters_for_drive().lidar.mount.vehicle_T_sensor(), world_));
  }

  /// The IMU's samples up to the end of the next turn, beginning 5 s before the first one.
  void imu_speaks() {
    const model::Utime until = kBegin + (count_ + 1) * kRevolution_us;
    for (; imu_utime_ <= until; imu_utime_ += 10'000)
      input_.add(imu_at(level_drive(), imu_utime_, 100.0, {}, random_));
  }

  /// The next turn; RMS of its points' errors in the plan [m], where they are at its stamp.
  double turn() {
    double square_m2 = 0.0;
    REQUIRE(turns_that_came(square_m2) == 1);
    return std::sqrt(square_m2 / static_cast<double>(world_.size()));
  }

  /// The next turn: how many came out, which may have waited for a sensor, and the sum of their
  /// points' squared errors.
  int turns_that_came(double& square_m2) {
    const model::Utime begin = kBegin + count_++ * kRevolution_us;
    const InputResults results = input_.add(sweep_at(
        track_, begin, test::parameters_for_drive().lidar.mount.vehicle_T_sensor(), world_));
    int sweeps = 0;
    for (const InputResult& result : results) {
      const auto* sweep = std::get_if<model::PointSweep>(&result);
      if (sweep == nullptr) continue;
      ++sweeps;
      stamp_ = sweep->utime;
      has_attitude_ = sweep->attitude.has_value();
      const geometry::SE2 vehicle_T_world = track_.planar(test::seconds(sweep->utime)).inverse();
      REQUIRE(sweep->points.size() == world_.size());
      for (std::size_t i = 0; i < world_.size(); ++i) {
        const Eigen::Vector2d is = vehicle_T_world * Eigen::Vector2d(world_[i].head<2>());
        square_m2 += (sweep->points[i].position().head<2>().cast<double>() - is).squaredNorm();
      }
    }
    return sweeps;
  }

  /// The filter's pose of the latest sweep.
  void filter_speaks(std::uint32_t landmarks, std::uint64_t resets = 0) {
    model::EkfPose pose;
    pose.utime = stamp_;
    // In a frame of its own.
    pose.ekf_map_T_vehicle = geometry::SE2(3.0, -2.0, 0.7 + static_cast<double>(resets)) *
                             track_.planar(test::seconds(stamp_));
    pose.landmarks_used = landmarks;
    pose.reset_counter = resets;
    input_.add(pose);
  }

  LidarImuInput& input() { return input_; }
  /// Whether the latest sweep says how the vehicle was inclined.
  bool has_attitude() const { return has_attitude_; }

 private:
  static test::Drive level_drive() {
    test::Drive drive;
    drive.tilt_rad = 0.0;
    drive.rough_rad = 0.0;
    return drive;
  }

  test::Track track_;
  LidarImuInput input_;
  std::vector<Eigen::Vector3d> world_;
  std::mt19937_64 random_{6};
  model::Utime imu_utime_ = kBegin - 5'000'000;
  model::Utime stamp_ = 0;
  bool has_attitude_ = false;
  int count_ = 0;
};

}  // namespace

TEST_CASE("without any sensor of motion sweeps are de-skewed by the filter's", "[stage][deskew]") {
  LaserAlone laser;
  double skewed = 0.0;
  double worst = 0.0;
  for (int k = 0; k < 30; ++k) {
    const double error = laser.turn();
    if (k == 0) skewed = error;
    if (k > 5) worst = std::max(worst, error);
    laser.filter_speaks(6);
  }
  CHECK(skewed > 0.2);
  CHECK(worst < 0.2 * skewed);
  CHECK(laser.input().counters().sweeps_by_filter > 20);
  CHECK(laser.input().counters().sweeps_not_deskewed < 8);
}

TEST_CASE("a filter without landmarks, or after a reset, gives no motion", "[stage][deskew]") {
  LaserAlone laser;
  for (int k = 0; k < 10; ++k) {
    laser.turn();
    laser.filter_speaks(6);
  }
  const double known = laser.turn();
  laser.filter_speaks(6, 1);
  CHECK(laser.turn() > 5.0 * known);
  LaserAlone blind;
  for (int k = 0; k < 10; ++k) {
    blind.turn();
    blind.filter_speaks(0);
  }
  CHECK(blind.input().counters().sweeps_by_filter == 0);
}

TEST_CASE("the filter's motion outlives a restart", "[state][deskew]") {
  LaserAlone laser;
  for (int k = 0; k < 10; ++k) {
    laser.turn();
    laser.filter_speaks(6);
  }
  LidarImuInput loaded(test::parameters_for_drive());
  loaded.load(laser.input().save());
  laser.input() = std::move(loaded);
  CHECK(laser.turn() < 0.05);
}

TEST_CASE("after the IMU fell silent, what the filter's motion de-skews has no attitude",
          "[stage][deskew]") {
  LaserAlone laser;
  for (int k = 0; k < 10; ++k) {
    laser.imu_speaks();
    laser.turn();
    laser.filter_speaks(6);
  }
  CHECK(laser.has_attitude());
  CHECK(laser.input().counters().sweeps_by_filter == 0);

  double square_m2 = 0.0;
  int sweeps = 0;
  for (int k = 0; k < 30; ++k) {
    sweeps += laser.turns_that_came(square_m2);
    laser.filter_speaks(6);
  }
  CHECK(sweeps > 20);
  CHECK(laser.input().counters().sweeps_by_filter > 10);
  CHECK_FALSE(laser.has_attitude());
}
