#include "common/io/oxts.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "common/io/data_error.hpp"
#include "common/io/number_reader.hpp"

namespace understory::io {
namespace {

constexpr std::size_t kValues = 25;  // the rest counts satellites
constexpr double kSemiMajor_m = 6378137.0;
constexpr double kEccentricity2 = 6.69437999014e-3;

}  // namespace

OxtsRecord parse_oxts(std::string_view text, std::string_view source) {
  NumberReader reader(text, std::string(source));
  std::array<double, kValues> v{};
  for (double& value : v) value = reader.require("one of 25 values of an OXTS record");
  if (std::abs(v[0]) > 90.0 || std::abs(v[1]) > 180.0)
    throw DataError(fmt::format("{}: {}, {} is no latitude and longitude", source, v[0], v[1]));

  OxtsRecord record;
  record.latitude_deg = v[0];
  record.longitude_deg = v[1];
  record.altitude_m = v[2];
  record.roll_pitch_yaw_rad << v[3], v[4], v[5];
  record.east_north_velocity_mps << v[7], v[6];
  record.forward_velocity_mps = v[8];
  record.specific_force_mps2 << v[11], v[12], v[13];
  record.angular_rate_rad_s << v[17], v[18], v[19];
  record.position_sigma_m = std::abs(v[23]);
  record.velocity_sigma_mps = std::abs(v[24]);

  return record;
}

LocalPlane::LocalPlane(double latitude_deg, double longitude_deg)
    : latitude_deg_(latitude_deg), longitude_deg_(longitude_deg) {
  const double degree = std::numbers::pi / 180.0;
  const double sine = std::sin(latitude_deg * degree);
  const double w = 1.0 - kEccentricity2 * sine * sine;
  north_per_deg_m_ = degree * kSemiMajor_m * (1.0 - kEccentricity2) / (w * std::sqrt(w));
  east_per_deg_m_ = degree * kSemiMajor_m / std::sqrt(w) * std::cos(latitude_deg * degree);
}

Eigen::Vector2d LocalPlane::east_north_m(double latitude_deg, double longitude_deg) const {
  // The shorter way round: a drive may cross the date line.
  return {std::remainder(longitude_deg - longitude_deg_, 360.0) * east_per_deg_m_,
          (latitude_deg - latitude_deg_) * north_per_deg_m_};
}

}  // namespace understory::io
