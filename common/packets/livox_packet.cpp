#include "common/packets/livox_packet.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <numbers>

#include "common/packets/bytes.hpp"
#include "common/packets/sensor_clock.hpp"

namespace understory::packets {
namespace {

using LivoxBytes = std::span<const std::uint8_t>;
using Coordinates = LivoxShotLayout::Coordinates;

constexpr double kCentidegree = std::numbers::pi / 18000.0;
constexpr std::size_t kImuBytes = 24;
constexpr std::int64_t kSecond_ns = 1'000'000'000;

// LivoxLidarEthernetPacket.
namespace sdk2 {
constexpr std::size_t kLengthAt = 1;
constexpr std::size_t kIntervalAt = 3;  // from the first point to the last [0.1 us]
constexpr std::size_t kPointsAt = 5;
constexpr std::size_t kNumberAt = 7;
constexpr std::size_t kTypeAt = 10;
constexpr std::size_t kTimeAt = 28;
constexpr std::size_t kDataAt = 36;
constexpr std::uint16_t kMostPoints = 96 * 4;
/// LivoxLidarPointDataType; 0 is an IMU sample.
constexpr std::array<LivoxShotLayout, 4> kLayouts{{{},
                                                   {Coordinates::kMillimetres, 14, 1},
                                                   {Coordinates::kCentimetres, 8, 1},
                                                   {Coordinates::kSpherical, 10, 1}}};

std::variant<Fault, LivoxHeader> header(LivoxBytes bytes) {
  if (bytes.size() < kDataAt || number_at<std::uint16_t>(bytes, kLengthAt) != bytes.size())
    return Fault::kWrongSize;
  const std::uint8_t type = bytes[kTypeAt];
  if (type >= kLayouts.size()) return Fault::kOtherModel;

  LivoxHeader header;
  header.is_imu = type == 0;
  header.data_at = kDataAt;
  header.shots = number_at<std::uint16_t>(bytes, kPointsAt);
  header.layout = kLayouts[type];
  header.span_ns = 100.0 * number_at<std::uint16_t>(bytes, kIntervalAt);
  header.number = number_at<std::uint16_t>(bytes, kNumberAt);
  const auto time_ns = number_at<std::uint64_t>(bytes, kTimeAt);
  const std::size_t data = header.is_imu ? kImuBytes : header.shots * header.layout.bytes;
  if (bytes.size() != kDataAt + data) return Fault::kWrongSize;
  if (header.shots > kMostPoints || time_ns > static_cast<std::uint64_t>(SensorClock::kLatest_ns))
    return Fault::kDamaged;
  header.time_ns = static_cast<std::int64_t>(time_ns);
  return header;
}
}  // namespace sdk2

// LivoxEthPacket.
namespace sdk1 {
constexpr std::size_t kTimeTypeAt = 8;
constexpr std::size_t kTypeAt = 9;
constexpr std::size_t kTimeAt = 10;
constexpr std::size_t kDataAt = 18;
constexpr std::uint8_t kImu = 6;
/// PointDataType, with the number of shots of a packet.
struct Points {
  std::size_t shots;
  LivoxShotLayout layout;
};
constexpr std::array<Points, 9> kPoints{{{100, {Coordinates::kMillimetres, 13, 1}},
                                         {100, {Coordinates::kSpherical, 9, 1}},
                                         {96, {Coordinates::kMillimetres, 14, 1}},
                                         {96, {Coordinates::kSpherical, 10, 1}},
                                         {48, {Coordinates::kMillimetres, 28, 2}},
                                         {48, {Coordinates::kSpherical, 16, 2}},
                                         {1, {}},
                                         {30, {Coordinates::kMillimetres, 42, 3}},
                                         {30, {Coordinates::kSpherical, 22, 3}}}};

/// TimestampType.
enum class Clock : std::uint8_t { kFree = 0, kPtp = 1, kUtc = 3, kPulse = 4 };

/// Year since 2000, month, day, hour, and microseconds of the hour.
std::optional<std::int64_t> utc_ns(LivoxBytes bytes) {
  const std::chrono::year_month_day day{std::chrono::year(2000 + bytes[kTimeAt]),
                                        std::chrono::month(bytes[kTimeAt + 1]),
                                        std::chrono::day(bytes[kTimeAt + 2])};
  const std::uint8_t hour = bytes[kTimeAt + 3];
  const auto micros = number_at<std::uint32_t>(bytes, kTimeAt + 4);
  if (!day.ok() || hour > 23 || micros >= 3'600'000'000) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days(day).time_since_epoch().count();
  return ((days * 24 + hour) * 3600) * kSecond_ns + std::int64_t{micros} * 1000;
}

/// The time within the second, in the second nearest to the reception.
std::int64_t near_reception_ns(std::int64_t within_ns, model::Utime received) {
  const std::int64_t late_ns = received * 1000 - within_ns;
  const std::int64_t seconds = (late_ns + kSecond_ns / 2) / kSecond_ns;
  return seconds * kSecond_ns + within_ns;
}

std::optional<std::int64_t> time_ns(LivoxBytes bytes, model::Utime received) {
  const auto clock = static_cast<Clock>(bytes[kTimeTypeAt]);
  if (clock == Clock::kUtc) return utc_ns(bytes);
  const auto count_ns = number_at<std::uint64_t>(bytes, kTimeAt);
  if (clock == Clock::kPulse)
    return count_ns > 2 * static_cast<std::uint64_t>(kSecond_ns)
               ? std::nullopt
               : std::optional(near_reception_ns(static_cast<std::int64_t>(count_ns), received));
  const bool is_count = clock == Clock::kFree || clock == Clock::kPtp;
  if (!is_count || count_ns > static_cast<std::uint64_t>(SensorClock::kLatest_ns))
    return std::nullopt;
  return static_cast<std::int64_t>(count_ns);
}

std::variant<Fault, LivoxHeader> header(LivoxBytes bytes, double shots_per_s,
                                        model::Utime received) {
  if (bytes.size() < kDataAt) return Fault::kWrongSize;
  const std::uint8_t type = bytes[kTypeAt];
  if (type >= kPoints.size()) return Fault::kOtherModel;

  LivoxHeader header;
  header.is_imu = type == kImu;
  header.data_at = kDataAt;
  header.shots = kPoints[type].shots;
  header.layout = kPoints[type].layout;
  header.span_ns = 1e9 * static_cast<double>(header.shots) / shots_per_s;
  const std::size_t data = header.is_imu ? kImuBytes : header.shots * header.layout.bytes;
  if (bytes.size() != kDataAt + data) return Fault::kWrongSize;
  const auto time = time_ns(bytes, received);
  if (!time) return Fault::kDamaged;
  header.time_ns = *time;
  return header;
}
}  // namespace sdk1

/// Theta from the z axis, phi in the plane from x.
Eigen::Vector3d from_sphere(double range_m, double theta, double phi) {
  return range_m * Eigen::Vector3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                                   std::cos(theta));
}

constexpr std::array kLivoxModels{LivoxModel::kMid360, LivoxModel::kHap, LivoxModel::kAvia,
                                  LivoxModel::kHorizon, LivoxModel::kMid70};

}  // namespace

std::optional<LivoxModel> livox_model(std::string_view name) {
  for (const LivoxModel model : kLivoxModels) {
    if (name == to_string(model)) return model;
  }
  return std::nullopt;
}

std::string_view to_string(LivoxModel model) {
  constexpr std::array<std::string_view, 5> kNames{"mid360", "hap", "avia", "horizon", "mid70"};
  return kNames[static_cast<std::size_t>(model)];
}

bool speaks_sdk1(LivoxModel model) {
  return model != LivoxModel::kMid360 && model != LivoxModel::kHap;
}

LivoxProperties livox_properties(LivoxModel model) {
  constexpr std::array<LivoxProperties, 5> kProperties{{{4, 100.0, 0.0},
                                                        {6, 200.0, 0.0},
                                                        {6, 450.0, 240'000.0},
                                                        {6, 260.0, 240'000.0},
                                                        {1, 260.0, 100'000.0}}};
  return kProperties[static_cast<std::size_t>(model)];
}

std::variant<Fault, LivoxHeader> read_livox_header(LivoxModel model, LivoxBytes bytes,
                                                   model::Utime received) {
  if (!speaks_sdk1(model)) return sdk2::header(bytes);
  return sdk1::header(bytes, livox_properties(model).shots_per_s, received);
}

LivoxReturn read_livox_return(LivoxBytes shot, const LivoxShotLayout& layout, std::size_t which) {
  LivoxReturn result;
  switch (layout.coordinates) {
    case Coordinates::kMillimetres: {
      constexpr std::size_t kReturnBytes = 14;
      const std::size_t at = kReturnBytes * which;
      result.position_m = 1e-3 * vector_at<std::int32_t>(shot, at);
      result.reflectivity = shot[at + 12];
      break;
    }
    case Coordinates::kCentimetres:
      result.position_m = 1e-2 * vector_at<std::int16_t>(shot, 0);
      result.reflectivity = shot[6];
      break;
    case Coordinates::kSpherical: {
      // Several returns of a shot have their angles before them.
      const bool is_single = layout.returns == 1;
      const std::size_t angles_at = is_single ? 4 : 0;
      const std::size_t range_at = is_single ? 0 : 4 + 6 * which;
      const double range_m = 1e-3 * number_at<std::uint32_t>(shot, range_at);
      const double theta = kCentidegree * number_at<std::uint16_t>(shot, angles_at);
      const double phi = kCentidegree * number_at<std::uint16_t>(shot, angles_at + 2);
      result.position_m = from_sphere(range_m, theta, phi);
      result.reflectivity = shot[is_single ? 8 : range_at + 4];
      break;
    }
  }
  return result;
}

bool is_livox_packet(LivoxBytes bytes) {
  return std::holds_alternative<LivoxHeader>(sdk2::header(bytes));
}

bool is_livox_sdk1_packet(LivoxBytes bytes) {
  return std::holds_alternative<LivoxHeader>(sdk1::header(bytes, 1.0, 0));
}

}  // namespace understory::packets
