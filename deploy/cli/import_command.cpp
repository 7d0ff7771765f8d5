// `understory import`: a recording made elsewhere into an LCM log.
#include <fmt/format.h>

#include <limits>
#include <memory>
#include <string>

#include "common/io/data_error.hpp"
#include "common/io/victoria_park.hpp"
#include "common/terminal/interrupt.hpp"
#include "common/terminal/progress.hpp"
#include "common/wire/convert.hpp"
#include "deploy/cli/commands.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/guarded_import.hpp"
#include "deploy/cli/import_bag.hpp"
#include "deploy/cli/import_clouds.hpp"
#include "deploy/cli/import_packets.hpp"
#include "deploy/cli/import_sensors.hpp"
#include "deploy/cli/import_stem_frames.hpp"
#include "deploy/cli/original_log.hpp"
#include "services/lidar_imu_input/wheel_odometry.hpp"

namespace understory::cli {
namespace {

struct VictoriaParkImportOptions {
  std::string path;
  std::string out;
  bool raw = false;
};

/// The recording as messages in order of time. Of one stamp: wheels, odometry, GNSS, laser, so that
/// whoever takes a sweep has the motion up to it.
class Importer {
 public:
  /// `raw`: what the sensors gave, for lidar_imu_input; else what it makes of that.
  Importer(const io::VictoriaPark& recording, OriginalLog& writer, bool raw)
      : recording_(recording), writer_(writer), odometry_(parameters()), raw_(raw) {}

  void run() {
    terminal::Progress progress("importing", static_cast<double>(recording_.scans.size()));
    for (const model::PlanarScan& scan : recording_.scans) {
      terminal::throw_if_interrupted();
      write_until(scan.utime);
      const auto motion = odometry_.advance_to(scan.utime);
      if (motion && !raw_) write("ODOMETRY", *motion);
      write(raw_ ? "RAW_SCAN" : "LIDAR_SCAN", scan);
      progress.update(static_cast<double>(scan.sequence + 1));
    }
    write_until(std::numeric_limits<model::Utime>::max());
  }

 private:
  static lidar_imu_input::WheelOdometryParameters parameters() {
    lidar_imu_input::WheelOdometryParameters parameters;
    parameters.car = {io::victoria_park::kWheelbase_m, io::victoria_park::kEncoderLeft_m,
                      io::victoria_park::axle_T_vehicle()};
    return parameters;
  }

  template <class Message>
  void write(const std::string& channel, const Message& message) {
    writer_.write(message.utime, channel, wire::encode_message(message));
  }

  /// Wheels and fixes up to a stamp, the earlier ones first.
  void write_until(model::Utime stamp) {
    const auto& wheels = recording_.wheels;
    const auto& fixes = recording_.gnss;
    const auto due = [&](const auto& list, std::size_t at) {
      return at < list.size() && list[at].utime <= stamp;
    };

    while (due(wheels, wheel_) || due(fixes, fix_)) {
      const bool wheel_first =
          due(wheels, wheel_) && (!due(fixes, fix_) || wheels[wheel_].utime <= fixes[fix_].utime);
      if (wheel_first) {
        odometry_.add(wheels[wheel_]);
        write(raw_ ? "RAW_WHEELS" : "WHEELS", wheels[wheel_++]);
      } else {
        write(raw_ ? "RAW_GNSS" : "GNSS", fixes[fix_++]);
      }
    }
  }

  const io::VictoriaPark& recording_;
  OriginalLog& writer_;
  lidar_imu_input::WheelOdometry odometry_;
  bool raw_;
  std::size_t wheel_ = 0;
  std::size_t fix_ = 0;
};

void import_victoria_park(const VictoriaParkImportOptions& options) {
  refuse_to_overwrite(options.path, options.out);
  guarded_import([&] {
    const io::VictoriaPark recording = io::read_victoria_park(options.path);
    OriginalLog writer(options.out, "understory import");
    Importer(recording, writer, options.raw).run();
    writer.commit();
    fmt::print("{} sweeps, {} wheel samples, {} fixes -> {}\n", recording.scans.size(),
               recording.wheels.size(), recording.gnss.size(), options.out);
  });
}

}  // namespace

void add_import_command(CLI::App& parent) {
  auto* command = parent.add_subcommand("import", "A recording made elsewhere into an LCM log");
  command->require_subcommand(1);
  auto* victoria = command->add_subcommand(
      "victoria-park", "The Victoria Park set: laser, wheels and GPS of a car among trees");
  auto options = std::make_shared<VictoriaParkImportOptions>();
  victoria
      ->add_option("path", options->path,
                   "victoria_park_ascii.zip, or a folder with LASER.txt, DRS.txt and GPS.txt")
      ->required();
  victoria->add_option("--out", options->out, "The log to write")->required();
  victoria->add_flag("--raw", options->raw,
                     "Write RAW_SCAN, RAW_WHEELS, RAW_GNSS: the inputs of lidar_imu_input");

  victoria->callback([options] { import_victoria_park(*options); });
  add_bag_import(*command);
  add_sensor_imports(*command);
  add_cloud_import(*command);
  add_packet_import(*command);
  add_stem_frames_import(*command);
}

}  // namespace understory::cli
