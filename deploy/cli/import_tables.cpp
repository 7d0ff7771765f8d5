#include "deploy/cli/import_tables.hpp"

#include <fmt/format.h>

#include "common/io/recording_folder.hpp"
#include "common/io/sensor_tables.hpp"

namespace understory::cli {

std::string read_recorded(const std::string& path) {
  const std::filesystem::path file(path);
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  return io::RecordingFolder(folder).read(file.filename().string());
}

void add_tables(const SensorTables& tables, RecordingLog& log) {
  if (!tables.imu.empty()) {
    for (const model::ImuSample& sample :
         io::parse_imu_table(read_recorded(tables.imu), tables.imu))
      log.add("RAW_IMU", sample);
  }

  if (!tables.wheels.empty()) {
    for (const model::WheelSample& sample :
         io::parse_wheel_table(read_recorded(tables.wheels), tables.wheels))
      log.add("RAW_WHEELS", sample);
  }

  if (!tables.gnss.empty()) {
    for (const model::GnssFix& fix : io::parse_gnss_table(read_recorded(tables.gnss), tables.gnss))
      log.add("RAW_GNSS", fix);
  }
}

void report_tables(const RecordingLog& log, std::size_t sweeps, const std::string& out) {
  fmt::print("{} sweeps, {} IMU samples, {} wheel samples, {} fixes -> {}\n", sweeps,
             log.count("RAW_IMU"), log.count("RAW_WHEELS"), log.count("RAW_GNSS"), out);
}

void add_table_options(CLI::App& command, SensorTables& tables) {
  command.add_option("--imu", tables.imu, "CSV: t_s,gx,gy,gz,ax,ay,az (rad/s, m/s^2)");
  command.add_option("--gnss", tables.gnss,
                     "CSV: t_s, latitude_deg,longitude_deg or east_m,north_m, sigma_m, "
                     "ve_mps,vn_mps,velocity_sigma_mps");
  command.add_option("--wheels", tables.wheels, "CSV: t_s,speed_mps,steering_rad");
}

}  // namespace understory::cli
