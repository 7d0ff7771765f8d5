#include "deploy/cli/import_sensors.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/io/data_error.hpp"
#include "common/io/kitti_raw.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/guarded_import.hpp"
#include "deploy/cli/import_tables.hpp"
#include "deploy/cli/recording_log.hpp"
#include "understory/ground_truth_t.hpp"

namespace understory::cli {
namespace {

struct SensorImportOptions {
  std::string path;
  std::string out;
  bool wheels = false;
  std::string poses = "icp";
  std::vector<double> laser;  ///< x_m, y_m, yaw_rad on the vehicle; empty = KITTI's.
  SensorTables tables;
};

ground_truth_t truth(model::Utime utime, const geometry::SE2& pose) {
  ground_truth_t message{};
  message.utime = utime;
  message.world_T_vehicle = wire::to_wire(pose);
  return message;
}

void add_oxts(const io::KittiRaw& drive, bool wheels, RecordingLog& log) {
  if (drive.oxts().empty()) return;
  const io::LocalPlane plane(drive.oxts().front().latitude_deg, drive.oxts().front().longitude_deg);
  for (const io::OxtsRecord& record : drive.oxts()) {
    model::ImuSample imu;
    imu.utime = record.utime;
    imu.angular_rate_rad_s = record.angular_rate_rad_s;
    imu.specific_force_mps2 = record.specific_force_mps2;
    log.add("RAW_IMU", imu);
    if (wheels)
      log.add("RAW_WHEELS", model::WheelSample{record.utime, 0, record.forward_velocity_mps, 0.0});
    model::GnssFix fix;

    fix.utime = record.utime;
    fix.east_north_m = plane.east_north_m(record.latitude_deg, record.longitude_deg);
    fix.sigma_m = record.position_sigma_m;
    fix.velocity_mps = record.east_north_velocity_mps;
    fix.velocity_sigma_mps = record.velocity_sigma_mps;
    gnss_t message = wire::to_wire(fix);
    message.has_geodetic = 1;
    message.latitude_deg = record.latitude_deg;
    message.longitude_deg = record.longitude_deg;
    message.altitude_m = record.altitude_m;
    log.add("RAW_GNSS", message);
    log.add("GROUND_TRUTH",
            truth(record.utime, geometry::SE2(fix.east_north_m, record.roll_pitch_yaw_rad.z())));
  }
}

/// Where the laser sits, for the configuration of lidar_imu_input.
void print_mount(const Eigen::Isometry3d& imu_T_velo) {
  const Eigen::Matrix3d m = imu_T_velo.linear();
  fmt::print(
      "laser on the OXTS unit: x {:.4f} y {:.4f} z {:.4f} m, roll {:.5f} pitch {:.5f} yaw {:.5f} "
      "rad\n",
      imu_T_velo.translation().x(), imu_T_velo.translation().y(), imu_T_velo.translation().z(),
      std::atan2(m(2, 1), m(2, 2)), -std::asin(m(2, 0)), std::atan2(m(1, 0), m(0, 0)));
}

template <class Drive>
void add_sweeps(const Drive& drive, RecordingLog& log) {
  terminal::Progress progress("importing", static_cast<double>(drive.sweeps()));
  for (std::size_t i = 0; i < drive.sweeps(); ++i) {
    terminal::throw_if_interrupted();
    log.add_sweep("RAW_SWEEP", drive.read_sweep(i));
    progress.update(static_cast<double>(i + 1));
  }
}

void import_kitti(const SensorImportOptions& options) {
  const io::KittiRaw drive(options.path);
  RecordingLog log(options.out);
  add_oxts(drive, options.wheels, log);
  add_sweeps(drive, log);
  log.commit();
  if (drive.imu_T_velo()) print_mount(*drive.imu_T_velo());
  fmt::print("{} sweeps, {} OXTS records -> {}\n", drive.sweeps(), drive.oxts().size(),
             options.out);
}

void import_kitti_reduced(const SensorImportOptions& options) {
  const io::ReducedKitti drive(options.path, options.poses);
  const geometry::SE2 vehicle_T_laser =
      options.laser.empty() ? io::kitti::vehicle_T_laser()
                            : geometry::SE2(options.laser[0], options.laser[1], options.laser[2]);
  const geometry::SE2 laser_T_vehicle = vehicle_T_laser.inverse();
  RecordingLog log(options.out);
  // The poses are the laser's; `world` stays where they have it.
  for (const io::ReducedKittiPose& pose : drive.poses())
    log.add("GROUND_TRUTH", truth(pose.utime, pose.world_T_sensor * laser_T_vehicle));
  add_sweeps(drive, log);
  log.commit();
  fmt::print("{} sweeps with poses ({}) -> {}\n", drive.sweeps(), options.poses, options.out);
}

void import_csv(const SensorImportOptions& options) {
  if (options.tables.empty()) fail("import csv: none of --imu, --gnss, --wheels is given");
  RecordingLog log(options.out);
  add_tables(options.tables, log);
  log.commit();
  report_tables(log, 0, options.out);
}

CLI::App* add_format(CLI::App& import, const std::string& name, const std::string& what,
                     const std::string& path, const std::shared_ptr<SensorImportOptions>& options,
                     void (*run)(const SensorImportOptions&)) {
  CLI::App* command = import.add_subcommand(name, what);
  if (!path.empty()) command->add_option("path", options->path, path)->required();
  command->add_option("--out", options->out, "The log to write")->required();
  command->callback([options, run] {
    refuse_to_overwrite(options->path, options->out);
    guarded_import([&] { run(*options); });
  });
  return command;
}

}  // namespace

void add_sensor_imports(CLI::App& import) {
  const auto options = std::make_shared<SensorImportOptions>();
  add_format(import, "kitti", "A drive of the KITTI raw data: Velodyne sweeps and OXTS records",
             "Folder of the drive (with velodyne_points and oxts)", options, import_kitti)
      ->add_flag("--speed-as-wheels", options->wheels,
                 "Write the OXTS forward velocity as RAW_WHEELS (derived from GNSS)");
  CLI::App* reduced =
      add_format(import, "kitti-reduced", "KITTI drive 0005 with 16 of 64 beams, and its poses",
                 "Folder with sweeps.bin and poses_*.csv", options, import_kitti_reduced);
  reduced->add_option("--poses", options->poses, "icp (default) or oxts")
      ->check(CLI::IsMember({"icp", "oxts"}));
  reduced
      ->add_option("--laser", options->laser,
                   "x,y,yaw [m, rad] of the laser on the vehicle (the poses are the laser's); "
                   "default: that of 2011_09_26, as in deploy/config/kitti")
      ->delimiter(',')
      ->expected(3);
  CLI::App* csv =
      add_format(import, "csv", "Tables of IMU, GNSS and wheels", "", options, import_csv);
  add_table_options(*csv, options->tables);
}

}  // namespace understory::cli
