// Every configuration that comes with the project, on raw data of the vehicle that it describes.
#include <map>
#include <set>

#include "common/bus/launch_config.hpp"
#include "eval/harness/chain_drive.hpp"
#include "services/lidar_imu_input/adapter.hpp"
#include "sim/drive.hpp"
#include "sim/scenarios.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval;
namespace fs = std::filesystem;

namespace {

/// Numbers of a folder's lidar_imu_input, by key.
class InputNumbers {
 public:
  explicit InputNumbers(const fs::path& folder)
      : adapter_(lidar_imu_input::lidar_imu_input_service().make()) {
    adapter_->describe(table_);
    // `runtime` is the process's own table.
    table_.load(bus::config_file_in(folder, "lidar_imu_input"));
  }
  double operator()(const std::string& key) const {
    const auto entry = std::ranges::find(table_.entries(), key, &bus::ParameterTable::Entry::key);
    REQUIRE(entry != table_.entries().end());
    return *std::get<bus::ParameterTable::Number>(entry->target).value;
  }
  Eigen::Isometry3d mount(const std::string& sensor) const {
    const auto at = [&](const char* key) { return (*this)(sensor + ".mount." + key); };
    return Eigen::Translation3d(at("x_m"), at("y_m"), at("z_m")) *
           Eigen::AngleAxisd(at("yaw_rad"), Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(at("pitch_rad"), Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(at("roll_rad"), Eigen::Vector3d::UnitX());
  }

 private:
  std::unique_ptr<bus::Adapter> adapter_;
  bus::ParameterTable table_;
};

/// A vehicle as the folder describes it, 60 m through a forest; `laser_of_one_plane` instead of
/// LIDAR and IMU.
harness::ChainRun drive_through(const fs::path& folder, bool laser_of_one_plane) {
  const InputNumbers numbers(folder);
  sim::VehicleParameters vehicle;
  vehicle.wheelbase_m = numbers("wheels.wheelbase_m");
  const Eigen::Vector2d axle_to_vehicle(numbers("wheels.axle_T_vehicle.x_m"),
                                        numbers("wheels.axle_T_vehicle.y_m"));
  const Eigen::Isometry3d axle_T_vehicle(
      Eigen::Translation3d(axle_to_vehicle.x(), axle_to_vehicle.y(), 0.0));

  sim::SensorSuite suite;
  suite.gnss.reset();
  suite.wheels->encoder_left_m = numbers("wheels.encoder_left_m");
  if (laser_of_one_plane) {
    suite.imu.reset();
    suite.lidar.reset();
    suite.planar_laser.emplace();
    suite.planar_laser->rate_hz = 5.0;
    suite.planar_laser->revolution_s = 0.0;  // as the recording says
    suite.planar_laser->vehicle_T_sensor = axle_T_vehicle * numbers.mount("planar");
    suite.planar_laser->vehicle_T_sensor.translation().z() = 0.8;
  } else {
    suite.imu->vehicle_T_sensor = axle_T_vehicle * numbers.mount("imu");
    suite.lidar->vehicle_T_sensor = axle_T_vehicle * numbers.mount("lidar");
    suite.lidar->elevations_rad = sim::beam_elevations_rad(sim::LidarModel::kVlp16);
    suite.lidar->columns = 900;
  }

  sim::ForestScenarioParameters forest;
  forest.length_m = 60.0;
  sim::SensorDrive drive(sim::forest_scenario(forest, 21), vehicle, sim::SpeedParameters{}, suite,
                         21);
  harness::ChainOptions options;
  options.config_dir = folder;
  harness::ChainRun run = drive_chain(drive, options);
  const geometry::SE2 axle_T_origin(axle_to_vehicle, 0.0);
  for (metrics::StampedPose& truth : run.truth) truth.pose = truth.pose * axle_T_origin;
  return run;
}

/// The true motion between two scans.
model::Odometry odometry_of(const sim::Drive& drive, std::size_t k) {
  model::Odometry increment;
  increment.sequence = k;
  increment.from_utime = drive.utime(k - 1);
  increment.utime = drive.utime(k);
  increment.from_T_to = drive.world_T_vehicle()[k - 1].inverse() * drive.world_T_vehicle()[k];
  increment.covariance = Eigen::Vector3d(1e-5, 1e-5, 1e-6).asDiagonal();
  increment.has_wheels = true;
  return increment;
}

/// Landmarks of a detector, as a folder without lidar_imu_input takes them.
harness::ChainRun feed_landmarks(const fs::path& folder, bool with_odometry) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.forest.side_m = 300.0;
  parameters.path.length_m = 40.0;
  const sim::Drive drive(parameters, 21);

  harness::ChainRun run;
  harness::SensorChain chain(harness::services_of(folder), folder);
  watch_chain(chain, run);
  for (std::size_t k = 0; k < drive.size(); ++k) {
    run.truth.push_back({drive.utime(k), drive.world_T_vehicle()[k]});
    if (with_odometry && k > 0) chain.feed("ODOMETRY", wire::encode_message(odometry_of(drive, k)));
    chain.feed("LANDMARKS", wire::encode_message(drive.scan(k).scan));
  }
  finish_chain(chain, run);
  return run;
}

void check_map(const harness::ChainRun& run, double limit_m) {
  const auto error = harness::trajectory_error(harness::poses_of(run.slam), run.truth);
  CAPTURE(run.landmarks.size(), run.slam.size(), run.updates.size(), error.ate_rms_m,
          error.driven_m);
  CHECK(run.landmarks.size() > 20);
  CHECK(run.slam.size() > 100);
  CHECK(error.driven_m > 30.0);
  CHECK(error.ate_rms_m < limit_m);
  CHECK(wrong_updates(run) == 0);
}

}  // namespace

TEST_CASE("every configuration that comes with the project makes a map of raw data") {
  // Limits at three times what was measured, and more folders than these would be untested.
  const std::map<std::string, double> limit_m = {
      {"", 0.11},           {"lidar", 0.015},       {"velodyne", 0.015},
      {"ouster", 0.015},    {"livox", 0.015},       {"hesai", 0.015},
      {"kitti", 0.01},      {"victoria_park", 0.1}, {"stem_frames", 0.03},
      {"simulated", 0.015}, {"planar", 0.1}};
  const std::set<std::string> one_plane = {"planar", "victoria_park"};
  std::map<std::string, harness::ChainRun> runs;
  const fs::path root = UNDERSTORY_SOURCE_CONFIG;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.path().filename() != "launch.toml") continue;
    const fs::path folder = entry.path().parent_path();
    const std::string name = folder == root ? "" : folder.lexically_relative(root).string();
    CAPTURE(name);
    REQUIRE(limit_m.contains(name));
    const bool has_input = !harness::services_of(folder).empty() &&
                           harness::services_of(folder).front().name == "lidar_imu_input";
    CHECK((has_input || name.empty() || name == "stem_frames"));
    runs[name] = has_input ? drive_through(folder, one_plane.contains(name))
                           : feed_landmarks(folder, name == "stem_frames");
    check_map(runs.at(name), limit_m.at(name));
  }
  CHECK(runs.size() == limit_m.size());

  // What is measured is what hardware gets: a driver in front changes nothing behind it.
  const auto& measured = runs.at("lidar").slam;
  const auto& shipped = runs.at("velodyne").slam;
  REQUIRE(measured.size() == shipped.size());
  CHECK(measured.back().map_T_vehicle().coordinates() ==
        shipped.back().map_T_vehicle().coordinates());
  CHECK(measured.back().covariance == shipped.back().covariance);
}
