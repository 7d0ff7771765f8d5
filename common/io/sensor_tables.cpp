#include "common/io/sensor_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "common/io/data_error.hpp"
#include "common/io/number_reader.hpp"
#include "common/io/oxts.hpp"

namespace understory::io {
namespace {

/// No sensor of a vehicle reads more, in SI units or degrees; northings end at 1e7 m.
constexpr double kGreatest = 1e9;

/// Rows of numbers under a heading of names.
class Table {
 public:
  Table(std::string_view text, std::string_view source) : source_(source) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string name;
    for (const char c : text.substr(0, end)) {
      if (c == ',' || c == ';' || c == ' ' || c == '\t' || c == '\r' || c == '#') {
        if (!name.empty()) names_.push_back(std::exchange(name, {}));
      } else {
        name.push_back(c);
      }
    }

    if (!name.empty()) names_.push_back(name);
    if (names_.empty()) throw DataError(fmt::format("{}: no heading", source_));

    NumberReader reader(text.substr(end), source_);
    while (const auto first = reader.next()) {
      take(0, *first, reader);
      for (std::size_t i = 1; i < names_.size(); ++i) take(i, reader.require(names_[i]), reader);
    }
  }

  std::size_t rows() const { return values_.size() / names_.size(); }
  double at(std::size_t row, std::size_t column) const {
    return values_[row * names_.size() + column];
  }
  std::optional<std::size_t> find(std::string_view name) const {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) return std::nullopt;
    return static_cast<std::size_t>(found - names_.begin());
  }
  std::size_t require(std::string_view name) const {
    if (const auto column = find(name)) return *column;
    throw DataError(fmt::format("{}: no column {} in the heading", source_, name));
  }
  /// Stamps of all rows; they must advance.
  std::vector<model::Utime> stamps() const {
    const auto nanos = find("t_ns");
    const auto micros = find("t_us");
    const std::size_t column = nanos ? *nanos : micros ? *micros : require("t_s");
    const double unit = nanos ? 1e-3 : micros ? 1.0 : 1e6;
    std::vector<model::Utime> stamps;

    for (std::size_t row = 0; row < rows(); ++row) {
      const double value = at(row, column) * unit;
      if (!(value >= 0.0 && value < 9e15))
        throw DataError(fmt::format("{}, row {}: no time", source_, row + 1));
      stamps.push_back(static_cast<model::Utime>(std::llround(value)));
      if (row > 0 && stamps[row] <= stamps[row - 1])
        throw DataError(fmt::format("{}, row {}: time does not advance", source_, row + 1));
    }

    return stamps;
  }

 private:
  /// Stamps are checked separately.
  void take(std::size_t column, double value, const NumberReader& reader) {
    if (std::abs(value) > kGreatest && !names_[column].starts_with("t_")) {
      throw DataError(fmt::format("{}: {} {} is no reading of a sensor", reader.where(),
                                  names_[column], value));
    }
    values_.push_back(value);
  }

  std::string source_;
  std::vector<std::string> names_;
  std::vector<double> values_;
};

}  // namespace

std::vector<model::ImuSample> parse_imu_table(std::string_view text, std::string_view source) {
  const Table table(text, source);
  const std::vector<model::Utime> stamps = table.stamps();
  const std::size_t g[] = {table.require("gx"), table.require("gy"), table.require("gz")};
  const std::size_t a[] = {table.require("ax"), table.require("ay"), table.require("az")};
  std::vector<model::ImuSample> samples(table.rows());

  for (std::size_t row = 0; row < samples.size(); ++row) {
    samples[row].utime = stamps[row];
    samples[row].sequence = row;
    for (int axis = 0; axis < 3; ++axis) {
      samples[row].angular_rate_rad_s(axis) = table.at(row, g[axis]);
      samples[row].specific_force_mps2(axis) = table.at(row, a[axis]);
    }
  }

  return samples;
}

std::vector<model::GnssFix> parse_gnss_table(std::string_view text, std::string_view source) {
  const Table table(text, source);
  const std::vector<model::Utime> stamps = table.stamps();
  const bool geodetic = table.find("latitude_deg").has_value();
  const std::size_t north = table.require(geodetic ? "latitude_deg" : "north_m");
  const std::size_t east = table.require(geodetic ? "longitude_deg" : "east_m");
  const auto sigma = table.find("sigma_m");
  const auto east_velocity = table.find("ve_mps");

  const auto north_velocity = table.find("vn_mps");
  const auto velocity_sigma = table.find("velocity_sigma_mps");
  std::vector<model::GnssFix> fixes(table.rows());
  std::optional<LocalPlane> plane;
  if (geodetic && table.rows() > 0) plane.emplace(table.at(0, north), table.at(0, east));

  for (std::size_t row = 0; row < fixes.size(); ++row) {
    model::GnssFix& fix = fixes[row];
    fix.utime = stamps[row];
    fix.sequence = row;
    fix.east_north_m = plane ? plane->east_north_m(table.at(row, north), table.at(row, east))
                             : Eigen::Vector2d(table.at(row, east), table.at(row, north));
    if (sigma) fix.sigma_m = std::abs(table.at(row, *sigma));
    if (east_velocity && north_velocity)
      fix.velocity_mps =
          Eigen::Vector2d(table.at(row, *east_velocity), table.at(row, *north_velocity));
    if (velocity_sigma) fix.velocity_sigma_mps = std::abs(table.at(row, *velocity_sigma));
  }

  return fixes;
}

std::vector<model::WheelSample> parse_wheel_table(std::string_view text, std::string_view source) {
  const Table table(text, source);
  const std::vector<model::Utime> stamps = table.stamps();
  const std::size_t speed = table.require("speed_mps");
  const auto steering = table.find("steering_rad");
  std::vector<model::WheelSample> samples(table.rows());
  for (std::size_t row = 0; row < samples.size(); ++row)
    samples[row] = {stamps[row], row, table.at(row, speed),
                    steering ? table.at(row, *steering) : 0.0};
  return samples;
}

}  // namespace understory::io
