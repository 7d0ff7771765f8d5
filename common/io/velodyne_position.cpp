// Position packets: position and time in NMEA from the laser's GNSS receiver.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "common/io/velodyne.hpp"

namespace understory::io {
namespace {

constexpr std::size_t kPositionTimeAt = 198;
constexpr std::size_t kSentenceAt = 206;
constexpr double kKnot_mps = 1852.0 / 3600.0;

std::optional<double> number(std::string_view field) {
  double value = 0.0;
  const auto result = std::from_chars(field.data(), field.data() + field.size(), value);
  if (result.ec != std::errc{} || result.ptr != field.data() + field.size()) return std::nullopt;
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

bool checksum_is_right(std::string_view sentence) {
  const std::size_t star = sentence.find('*');
  if (sentence.empty() || sentence.front() != '$' || star == std::string_view::npos ||
      star + 3 > sentence.size())
    return false;
  unsigned sum = 0;
  for (const char c : sentence.substr(1, star - 1)) sum ^= static_cast<unsigned char>(c);
  unsigned told = 0;
  const char* digits = sentence.data() + star + 1;
  const auto result = std::from_chars(digits, digits + 2, told, 16);
  return result.ec == std::errc{} && result.ptr == digits + 2 && told == sum;
}

/// ddmm.mmmm and a hemisphere to degrees.
std::optional<double> angle(std::string_view field, std::string_view hemisphere, char negative) {
  const auto value = number(field);
  if (!value || hemisphere.size() != 1 || *value < 0.0) return std::nullopt;
  const double degrees = std::floor(*value / 100.0);
  const double result = degrees + (*value - 100.0 * degrees) / 60.0;
  if (result > 180.0) return std::nullopt;
  return hemisphere.front() == negative ? -result : result;
}

}  // namespace

std::optional<VelodynePosition> parse_gprmc(std::string_view sentence) {
  if (!checksum_is_right(sentence)) return std::nullopt;
  std::array<std::string_view, 13> fields{};
  std::string_view rest = sentence.substr(0, sentence.find('*'));
  std::size_t count = 0;

  while (count < fields.size()) {
    const std::size_t comma = rest.find(',');
    fields[count++] = rest.substr(0, comma);
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }

  if (count < 10 || fields[0].size() != 6 || fields[0].substr(3) != "RMC") return std::nullopt;
  VelodynePosition position;
  const auto clock = number(fields[1]);
  const auto latitude = angle(fields[3], fields[4], 'S');
  const auto longitude = angle(fields[5], fields[6], 'W');
  if (!clock || *clock < 0.0 || *clock >= 240000.0) return std::nullopt;

  const double hours = std::floor(*clock / 10000.0);
  const double minutes = std::floor((*clock - 10000.0 * hours) / 100.0);
  const double seconds = *clock - 10000.0 * hours - 100.0 * minutes;
  position.day_us = std::llround((hours * 3600.0 + minutes * 60.0 + seconds) * 1e6);
  position.is_valid = fields[2] == "A" && latitude && longitude && std::abs(*latitude) <= 90.0;
  position.latitude_deg = latitude.value_or(0.0);
  position.longitude_deg = longitude.value_or(0.0);
  position.speed_mps = number(fields[7]).value_or(0.0) * kKnot_mps;
  position.course_rad = number(fields[8]).value_or(0.0) * std::numbers::pi / 180.0;

  return position;
}

std::optional<VelodynePosition> parse_velodyne_position(std::span<const std::uint8_t> packet) {
  if (packet.size() != kVelodynePositionBytes) return std::nullopt;
  std::string sentence;
  for (std::size_t i = kSentenceAt; i < packet.size(); ++i) {
    if (packet[i] == 0 || packet[i] == '\r' || packet[i] == '\n') break;
    sentence.push_back(static_cast<char>(packet[i]));
  }
  auto position = parse_gprmc(sentence);
  if (!position) return std::nullopt;
  for (std::size_t i = 0; i < 4; ++i)
    position->past_hour_us |= static_cast<std::uint32_t>(packet[kPositionTimeAt + i]) << (8U * i);
  return position;
}

}  // namespace understory::io
