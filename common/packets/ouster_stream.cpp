#include "common/packets/ouster_stream.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>
#include <utility>

#include "common/packets/bytes.hpp"

namespace understory::packets {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr double kStandardGravity_mps2 = 9.80665;
constexpr double kFullTurn_rad = 2.0 * std::numbers::pi;
constexpr std::size_t kImuBlockAt = 132;
constexpr std::size_t kImuSample = 36;
constexpr std::size_t kImuFooter = 32;
constexpr std::int64_t kLongestPacket_ns = 1'000'000'000;

/// Ranges from the data sheets (OS0, OS1, OS2, OSDome; Rev7, 80 % reflectivity and more).
double usual_range_m(std::string_view product_line) {
  if (product_line.starts_with("OS-0")) return 100.0;
  if (product_line.starts_with("OS-2")) return 500.0;
  if (product_line.starts_with("OS-DOME") || product_line.starts_with("OSDOME")) return 60.0;
  return 250.0;
}

/// One return of one beam.
struct Return {
  std::uint32_t range_mm = 0;
  std::uint8_t reflectivity = 0;
};

/// `parsing.cpp`, *_field_info: places of range and reflectivity, masks and units.
Return first_return(Bytes pixel, OusterPixel pixel_kind) {
  constexpr std::uint32_t kLegacyRange = 0xFFFFF;
  constexpr std::uint32_t kRange = 0x7FFFF;
  constexpr std::uint32_t kShortRange = 0x7FFF;  // in units of 8 mm
  const auto word = number_at<std::uint32_t>(pixel, 0);
  switch (pixel_kind) {
    case OusterPixel::kLegacy:
      return {word & kLegacyRange,
              static_cast<std::uint8_t>(std::min<int>(number_at<std::uint16_t>(pixel, 4), 255))};
    case OusterPixel::kSingle:
      return {word & kRange, pixel[4]};
    case OusterPixel::kDual:
      return {word & kRange, pixel[3]};
    case OusterPixel::kLowDataRate:
    case OusterPixel::kLowDataRateDual:
      return {(word & kShortRange) * 8, pixel[2]};
  }
  return {};
}

Return second_return(Bytes pixel, OusterPixel pixel_kind) {
  if (pixel_kind == OusterPixel::kDual)
    return {number_at<std::uint32_t>(pixel, 4) & 0x7FFFFU, pixel[7]};
  if (pixel_kind == OusterPixel::kLowDataRateDual)
    return {(number_at<std::uint32_t>(pixel, 4) & 0x7FFFU) * 8, pixel[6]};
  return {};
}

}  // namespace

OusterFormat ouster_format(const OusterProfile& profile, std::size_t beams,
                           std::size_t columns_per_packet) {
  const bool is_legacy = profile.pixel == OusterPixel::kLegacy;
  OusterFormat format;
  format.packet_header = is_legacy ? 0 : 32;
  format.column_header = is_legacy ? 16 : 12;
  format.pixel = profile.pixel_bytes;
  const std::size_t column_footer = is_legacy ? 4 : 0;
  const std::size_t packet_footer = is_legacy ? 0 : 32;
  format.column = format.column_header + beams * format.pixel + column_footer;
  format.packet = format.packet_header + columns_per_packet * format.column + packet_footer;
  return format;
}

bool is_ouster_imu_block(Bytes bytes) {
  constexpr std::uint8_t kImuPacket = 2;
  return bytes.size() > kImuBlockAt + kImuFooter && bytes[0] == kImuPacket &&
         (bytes.size() - kImuBlockAt - kImuFooter) % kImuSample == 0;
}

/// The header of a column.
struct OusterStream::Column {
  std::size_t at = 0;  ///< Its first byte in the packet.
  std::int64_t time_ns = 0;
  std::size_t id = 0;  ///< "Measurement id".
  bool is_valid = false;
};

OusterStream::OusterStream(OusterMetadata metadata, double max_range_m)
    : metadata_(std::move(metadata)),
      format_(ouster_format(metadata_.profile, metadata_.beams(), metadata_.columns_per_packet)),
      max_range_m_(max_range_m > 0.0 ? max_range_m : usual_range_m(metadata_.product_line)),
      builder_(static_cast<std::uint16_t>(metadata_.beams()), max_range_m_),
      rings_(metadata_.beams()),
      order_(metadata_.beams()) {
  std::iota(order_.begin(), order_.end(), 0);
  std::ranges::stable_sort(order_, {}, [&](std::size_t b) { return metadata_.altitude_rad[b]; });
  for (std::size_t ring = 0; ring < order_.size(); ++ring)
    rings_[order_[ring]] = static_cast<std::uint16_t>(ring);

  for (std::size_t beam = 0; beam < metadata_.beams(); ++beam) {
    const double altitude = metadata_.altitude_rad[beam];
    const double azimuth = -metadata_.azimuth_rad[beam];
    directions_.emplace_back(std::cos(altitude) * std::cos(azimuth),
                             std::cos(altitude) * std::sin(azimuth), std::sin(altitude));
  }
}

std::uint32_t OusterStream::frame_id(Bytes bytes) const {
  if (metadata_.profile.pixel == OusterPixel::kLegacy) return number_at<std::uint16_t>(bytes, 10);
  if (metadata_.profile.has_safety_header) return number_at<std::uint32_t>(bytes, 4);
  return number_at<std::uint16_t>(bytes, 2);
}

OusterStream::Column OusterStream::column_at(Bytes bytes, std::size_t number) const {
  Column column;
  column.at = format_.packet_header + number * format_.column;
  column.time_ns = number_at<std::int64_t>(bytes, column.at);
  column.id = number_at<std::uint16_t>(bytes, column.at + 8);
  if (metadata_.profile.pixel == OusterPixel::kLegacy) {
    column.is_valid = number_at<std::uint32_t>(bytes, column.at + format_.column - 4) == 0xFFFFFFFF;
  } else {
    column.is_valid = (number_at<std::uint16_t>(bytes, column.at + 10) & 1U) != 0;
  }
  return column;
}

std::optional<Fault> OusterStream::check(Bytes bytes) const {
  constexpr std::uint8_t kLidarPacket = 1;
  if (bytes.size() != format_.packet) return Fault::kWrongSize;
  if (metadata_.profile.pixel != OusterPixel::kLegacy && bytes[0] != kLidarPacket)
    return Fault::kOtherModel;

  constexpr int kSure = 2;
  if (short_frames_ >= kSure) return Fault::kOtherModel;

  std::optional<std::int64_t> first_ns;
  for (std::size_t c = 0; c < metadata_.columns_per_packet; ++c) {
    const Column column = column_at(bytes, c);
    if (!column.is_valid) continue;
    if (column.id >= metadata_.columns_per_frame || column.time_ns < 0 ||
        column.time_ns > SensorClock::kLatest_ns)
      return Fault::kDamaged;
    if (!first_ns) first_ns = column.time_ns;
    if (std::abs(column.time_ns - *first_ns) > kLongestPacket_ns) return Fault::kDamaged;
  }
  return std::nullopt;
}

Readings OusterStream::add(const Packet& packet) {
  Readings readings;
  ++counts_.packets;
  if (packet.bytes.size() == kOusterImuBytes) {
    add_imu_packet(packet, readings);
  } else if (packet.bytes.size() != format_.packet && is_ouster_imu_block(packet.bytes)) {
    add_imu_block(packet, readings);
  } else if (const auto fault = check(packet.bytes)) {
    readings.fault = fault;
  } else {
    add_lidar(packet, readings);
  }
  if (readings.fault) ++counts_.refused;
  counts_.sweeps += readings.sweeps.size();
  return readings;
}

/// Columns from the begin of the azimuth window to this one.
std::size_t OusterStream::from_window(std::size_t column) const {
  return (column + metadata_.columns_per_frame - metadata_.first_column) %
         metadata_.columns_per_frame;
}

/// Modes have 512, 1024 or 2048 columns. The wrong mode would deform the cloud.
bool OusterStream::is_of_fewer_columns() const {
  const std::size_t columns = metadata_.columns_per_frame;
  const bool is_whole_turn = from_window(metadata_.last_column) + 1 == columns;
  return is_whole_turn && has_begin_ && !has_gap_ &&
         (2 * next_column_ == columns || 4 * next_column_ == columns);
}

void OusterStream::end_frame(std::vector<model::PointSweep>& sweeps) {
  const std::size_t columns = from_window(metadata_.last_column) + 1;
  if (next_column_ < columns && has_begin_) ++counts_.gaps;
  auto sweep = builder_.take();
  if (is_of_fewer_columns()) {
    ++short_frames_;
  } else {
    short_frames_ = 0;
    if (sweep && has_begin_) sweeps.push_back(*std::move(sweep));
  }
  next_column_ = 0;
  has_gap_ = false;
}

void OusterStream::add_lidar(const Packet& packet, Readings& readings) {
  const std::uint32_t frame = frame_id(packet.bytes);
  // Numbers wrap: an earlier number is nearer backwards than forwards.
  const auto ahead = static_cast<std::int16_t>(frame - frame_id_.value_or(frame));
  constexpr int kLatestFrames = 3;
  if (ahead < 0 && ahead >= -kLatestFrames) {
    readings.fault = Fault::kLate;
    return;
  }

  if (ahead != 0) end_frame(readings.sweeps);
  // The begin of the first frame may be missing, because it was sent before.
  if (ahead != 0) has_begin_ = true;
  const bool is_first = !frame_id_;
  frame_id_ = frame;

  std::optional<std::int64_t> latest_ns;
  for (std::size_t c = 0; c < metadata_.columns_per_packet; ++c) {
    const Column column = column_at(packet.bytes, c);
    if (is_first && column.id == metadata_.first_column) has_begin_ = true;
    if (column.is_valid) latest_ns = column.time_ns;
  }
  if (latest_ns) take_time(*latest_ns, packet.received);

  for (std::size_t c = 0; c < metadata_.columns_per_packet; ++c) {
    const Column column = column_at(packet.bytes, c);
    if (!column.is_valid) continue;
    const std::size_t place = from_window(column.id);
    if (place > next_column_) {
      has_gap_ = true;
      if (has_begin_) ++counts_.gaps;
    }
    next_column_ = std::max(next_column_, place + 1);
    add_column(packet.bytes, column);
  }
}

/// Points collected before the clock was set are not part of the frame.
void OusterStream::take_time(std::int64_t time_ns, model::Utime received) {
  if (clock_.take(time_ns, received) == SensorClock::Step::kNext) return;
  ++counts_.jumps;
  builder_.clear();
  has_begin_ = false;
}

void OusterStream::add_column(Bytes bytes, const Column& column) {
  // The encoder counts against the angle (`xyzlut.cpp`).
  const double angle = kFullTurn_rad * (1.0 - static_cast<double>(column.id) /
                                                  static_cast<double>(metadata_.columns_per_frame));
  const Eigen::AngleAxisd lidar_R_encoder(angle, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d origin_m = metadata_.lidar_T_beam.translation();
  const Eigen::Vector3d offset_m =
      lidar_R_encoder * Eigen::Vector3d(origin_m.x(), 0.0, origin_m.z());
  const double offset = std::hypot(origin_m.x(), origin_m.z());
  const std::int64_t time_ns = clock_.placed_ns(column.time_ns);

  for (const std::size_t beam : order_) {
    const Bytes pixel =
        bytes.subspan(column.at + format_.column_header + beam * format_.pixel, format_.pixel);
    const Eigen::Vector3d direction = lidar_R_encoder * directions_[beam];
    const auto add_return = [&](const Return& reading) {
      const double range_m = 1e-3 * reading.range_mm;
      if (reading.range_mm == 0 || range_m >= max_range_m_) return;
      const Eigen::Vector3d in_lidar_m = (range_m - offset) * direction + offset_m;
      builder_.add((metadata_.sensor_T_lidar * in_lidar_m).cast<float>(), time_ns, rings_[beam],
                   reading.reflectivity);
    };

    const Return first = first_return(pixel, metadata_.profile.pixel);
    const Return second = second_return(pixel, metadata_.profile.pixel);
    add_return(first);
    if (second.range_mm != first.range_mm) add_return(second);
  }
}

/// One sample, in the IMU's axes.
struct OusterStream::ImuReading {
  std::int64_t time_ns = 0;
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();
};

/// Profile LEGACY: three times, then g and degrees per second.
void OusterStream::add_imu_packet(const Packet& packet, Readings& readings) {
  constexpr std::size_t kAccelerationTimeAt = 8;
  const ImuReading reading{number_at<std::int64_t>(packet.bytes, kAccelerationTimeAt),
                           kStandardGravity_mps2 * vector_at<float>(packet.bytes, 24),
                           std::numbers::pi / 180.0 * vector_at<float>(packet.bytes, 36)};
  add_sample(reading, packet.received, readings);
}

/// Profile ACCEL32_GYRO32_NMEA: samples with a header like a column's, in SI units (`packet.cpp`,
/// ImuPacket::accel()).
void OusterStream::add_imu_block(const Packet& packet, Readings& readings) {
  for (std::size_t at = kImuBlockAt; at + kImuFooter < packet.bytes.size(); at += kImuSample) {
    const bool is_valid = (number_at<std::uint16_t>(packet.bytes, at + 10) & 1U) != 0;
    if (!is_valid) continue;
    add_sample({number_at<std::int64_t>(packet.bytes, at), vector_at<float>(packet.bytes, at + 12),
                vector_at<float>(packet.bytes, at + 24)},
               packet.received, readings);
  }
}

void OusterStream::add_sample(const ImuReading& reading, model::Utime received,
                              Readings& readings) {
  constexpr double kMost = 1e4;
  if (reading.time_ns < 0 || reading.time_ns > SensorClock::kLatest_ns ||
      !(reading.acceleration_mps2.norm() < kMost) || !(reading.rate_rad_s.norm() < kMost)) {
    readings.fault = Fault::kDamaged;
    return;
  }
  take_time(reading.time_ns, received);

  const Eigen::Matrix3d sensor_R_imu = metadata_.sensor_T_imu.linear();
  model::ImuSample sample;
  sample.utime = clock_.placed_ns(reading.time_ns) / 1000;
  sample.sequence = imu_samples_++;
  sample.specific_force_mps2 = sensor_R_imu * reading.acceleration_mps2;
  sample.angular_rate_rad_s = sensor_R_imu * reading.rate_rad_s;
  readings.imu.push_back(sample);
}

std::optional<model::PointSweep> OusterStream::finish() {
  const bool is_whole = next_column_ == from_window(metadata_.last_column) + 1;
  auto sweep = builder_.take();
  if (!sweep || !has_begin_ || !is_whole) return std::nullopt;
  ++counts_.sweeps;
  return sweep;
}

}  // namespace understory::packets
