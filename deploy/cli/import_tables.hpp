// Tables of IMU, GNSS and wheels beside a recording.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "deploy/cli/recording_log.hpp"

namespace understory::cli {

/// Files of text; empty = none.
struct SensorTables {
  std::string imu, gnss, wheels;

  /// Whether none is given.
  bool empty() const { return imu.empty() && gnss.empty() && wheels.empty(); }
};

/// Adds --imu, --gnss and --wheels; `tables` must outlive the command.
void add_table_options(CLI::App& command, SensorTables& tables);
/// Their rows as RAW_IMU, RAW_GNSS and RAW_WHEELS. Throws io::DataError.
void add_tables(const SensorTables& tables, RecordingLog& log);
/// One line: what the log has.
void report_tables(const RecordingLog& log, std::size_t sweeps, const std::string& out);
/// The content of a file; of one in a zip archive likewise. Throws io::DataError.
std::string read_recorded(const std::string& path);

}  // namespace understory::cli
