#include "deploy/cli/import_clouds.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bag/cloud_decoder.hpp"
#include "common/bag/cloud_file.hpp"
#include "common/io/data_error.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/guarded_import.hpp"
#include "deploy/cli/import_cloud.hpp"
#include "deploy/cli/import_tables.hpp"
#include "deploy/cli/recording_log.hpp"

namespace understory::cli {
namespace {

struct CloudImportOptions {
  std::string folder;
  std::string out;
  double rate_hz = 0.0;
  std::string points_in;  ///< "sensor", "world" or not said.
  bag::CloudOptions cloud;
  SensorTables tables;
};

/// The points in the frame of the sensor, where VIEWPOINT says that it is not that of the file.
void move_to_sensor(const Eigen::Isometry3d& viewpoint, const std::string& points_in,
                    model::PointSweep& sweep) {
  if (points_in == "sensor" || viewpoint.isApprox(Eigen::Isometry3d::Identity(), 1e-6)) return;
  if (points_in.empty())
    throw io::DataError(
        "VIEWPOINT is not the identity: --points-in sensor, where the points are in the sensor's "
        "frame, or --points-in world, where they were moved by it");
  const Eigen::Isometry3f sensor_T_world = viewpoint.inverse().cast<float>();
  for (model::SweepPoint& point : sweep.points) {
    const Eigen::Vector3f moved = sensor_T_world * point.position();
    point.x_m = moved.x();
    point.y_m = moved.y();
    point.z_m = moved.z();
  }
}

/// One file as a sweep; none where it has no points.
std::optional<model::PointSweep> read_sweep(const bag::CloudEntry& entry,
                                            const CloudImportOptions& options,
                                            bag::CloudDecoder& decoder) {
  const std::string file = entry.path.string();
  bag::CloudFile parsed = bag::parse_cloud_file(read_recorded(file), entry.path);
  parsed.cloud.header.stamp_ns = entry.utime * 1000;
  try {
    model::PointSweep sweep = decoder.decode(parsed.cloud);
    if (sweep.points.empty()) return std::nullopt;
    move_to_sensor(parsed.viewpoint, options.points_in, sweep);
    return sweep;
  } catch (const io::DataError& error) {
    throw io::DataError(fmt::format("{}: {}", file, error.what()));
  }
}

void import_clouds(const CloudImportOptions& options) {
  const std::vector<bag::CloudEntry> files =
      bag::find_cloud_sequence(options.folder, options.rate_hz);
  RecordingLog log(options.out);
  add_tables(options.tables, log);
  bag::CloudDecoder decoder(options.cloud);
  terminal::Progress progress("importing", static_cast<double>(files.size()));
  std::size_t sweeps = 0;

  for (const bag::CloudEntry& file : files) {
    terminal::throw_if_interrupted();
    if (const auto sweep = read_sweep(file, options, decoder)) {
      log.add_sweep("RAW_SWEEP", *sweep);
      ++sweeps;
    }
    progress.advance();
  }
  if (sweeps == 0) throw io::DataError(fmt::format("{}: no file with a point", options.folder));

  log.require_common_time();
  log.commit();
  if (sweeps < files.size())
    fmt::print(stderr, "import clouds: {} of {} files have no points\n", files.size() - sweeps,
               files.size());
  fmt::print("{}\n", decoder.description());
  report_tables(log, sweeps, options.out);
}

}  // namespace

void add_cloud_import(CLI::App& import) {
  const auto options = std::make_shared<CloudImportOptions>();
  CLI::App* command =
      import
          .add_subcommand("clouds",
                          "A sequence of PCD, PLY or KITTI .bin files, one revolution each")
          ->alias("pcd");
  command
      ->add_option("folder", options->folder,
                   "Its files are of one kind; times from timestamps.txt, times.txt or the names")
      ->required();
  command->add_option("--out", options->out, "The log to write")->required();
  command
      ->add_option("--rate", options->rate_hz, "Files a second, where their names only count [Hz]")
      ->check(CLI::Range(0.1, 1000.0));
  add_cloud_options(*command, options->cloud);
  command
      ->add_option("--points-in", options->points_in,
                   "Where VIEWPOINT is not the identity: points are in the frame of the sensor, or "
                   "of the world in which VIEWPOINT is the sensor's pose")
      ->check(CLI::IsMember({"sensor", "world"}));
  add_table_options(*command, options->tables);

  command->callback([options] {
    refuse_to_overwrite(options->folder, options->out);
    guarded_import([&] { import_clouds(*options); });
  });
}

}  // namespace understory::cli
