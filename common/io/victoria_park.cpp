#include "common/io/victoria_park.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "common/io/data_error.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/recording_folder.hpp"

namespace understory::io {
namespace victoria_park {
namespace {

/// Largest accepted time stamp [s]: far beyond the recording, far below an overflow.
constexpr double kMaxTime_s = 1e6;

/// Reads the time stamp that starts a record; none at the end of the file. Time must advance.
class Stamps {
 public:
  std::optional<model::Utime> next(NumberReader& reader) {
    const auto seconds = reader.next();
    if (!seconds) return std::nullopt;

    if (*seconds < 0.0 || *seconds > kMaxTime_s) {
      throw DataError(
          fmt::format("{}: {} s is no time of this recording", reader.where(), *seconds));
    }

    const auto utime = static_cast<model::Utime>(std::llround(*seconds * 1e6));
    if (utime <= last_) {
      throw DataError(fmt::format(
          "{}: time {} s does not come after {} s (a token too many or too few before?)",
          reader.where(), *seconds, static_cast<double>(last_) * 1e-6));
    }

    last_ = utime;
    return utime;
  }

 private:
  model::Utime last_ = -1;
};

double require_within(NumberReader& reader, std::string_view what, double low, double high) {
  const double value = reader.require(what);
  if (value < low || value > high) {
    throw DataError(
        fmt::format("{}: {} = {} is not in [{}, {}]", reader.where(), what, value, low, high));
  }
  return value;
}

template <typename Record>
void require_some(const std::vector<Record>& records, std::string_view source) {
  if (records.empty()) throw DataError(fmt::format("{}: holds no record", source));
}

}  // namespace

std::vector<model::PlanarScan> parse_laser(std::string_view text, std::string_view source) {
  std::vector<model::PlanarScan> scans;
  NumberReader reader(text, std::string(source));
  Stamps stamps;

  while (const auto utime = stamps.next(reader)) {
    model::PlanarScan scan;
    scan.utime = *utime;
    scan.sequence = scans.size();
    scan.first_bearing_rad = -0.5 * std::numbers::pi;
    scan.bearing_step_rad = std::numbers::pi / 360.0;
    scan.max_range_m = victoria_park::kMaxRange_m;
    scan.ranges_m.reserve(victoria_park::kBeams);
    for (std::size_t beam = 0; beam < victoria_park::kBeams; ++beam) {
      scan.ranges_m.push_back(static_cast<float>(require_within(reader, "a range [m]", 0.0, 82.0)));
    }
    scans.push_back(std::move(scan));
  }

  require_some(scans, source);
  return scans;
}

std::vector<model::WheelSample> parse_wheels(std::string_view text, std::string_view source) {
  std::vector<model::WheelSample> wheels;
  NumberReader reader(text, std::string(source));
  Stamps stamps;
  while (const auto utime = stamps.next(reader)) {
    const double speed = require_within(reader, "the speed [m/s]", -30.0, 30.0);
    const double steering = require_within(reader, "the steering angle [rad]", -1.2, 1.2);
    wheels.push_back({*utime, wheels.size(), speed, steering});
  }
  require_some(wheels, source);
  return wheels;
}

std::vector<model::GnssFix> parse_gnss(std::string_view text, std::string_view source) {
  std::vector<model::GnssFix> fixes;
  NumberReader reader(text, std::string(source));
  Stamps stamps;
  while (const auto utime = stamps.next(reader)) {
    const double north = require_within(reader, "the latitude [m]", -1e5, 1e5);
    const double east = require_within(reader, "the longitude [m]", -1e5, 1e5);
    fixes.push_back({*utime, fixes.size(), {east, north}});
  }
  require_some(fixes, source);
  return fixes;
}

}  // namespace victoria_park

VictoriaPark read_victoria_park(const std::filesystem::path& path) {
  const RecordingFolder folder(path);
  VictoriaPark recording;
  recording.scans =
      victoria_park::parse_laser(folder.read("LASER.txt"), folder.describe("LASER.txt"));
  recording.wheels =
      victoria_park::parse_wheels(folder.read("DRS.txt"), folder.describe("DRS.txt"));
  recording.gnss = victoria_park::parse_gnss(folder.read("GPS.txt"), folder.describe("GPS.txt"));
  return recording;
}

}  // namespace understory::io
