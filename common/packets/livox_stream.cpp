#include "common/packets/livox_stream.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/packets/bytes.hpp"

namespace understory::packets {
namespace {

using LivoxBytes = std::span<const std::uint8_t>;

// LivoxLidarEthernetPacket.
constexpr std::size_t kLengthAt = 1;
constexpr std::size_t kIntervalAt = 3;  // from the first point to the last [0.1 us]
constexpr std::size_t kPointsAt = 5;
constexpr std::size_t kNumberAt = 7;  // of the packet; starts again with each frame
constexpr std::size_t kTypeAt = 10;
constexpr std::size_t kTimeAt = 28;
constexpr std::size_t kDataAt = 36;
constexpr std::uint16_t kMostPoints = 96 * 4;
/// A packet's first point may lie so much before the last one of the packet before it.
constexpr std::int64_t kLargestOverlap_ns = 2'000'000;

constexpr double kGravity_mps2 = 9.80665;  // IMU packets: rad/s and g
constexpr double kCentidegree = std::numbers::pi / 18000.0;

/// LivoxLidarPointDataType.
enum class DataType : std::uint8_t {
  kImu = 0,
  kCartesian_mm = 1,
  kCartesian_cm = 2,
  kSpherical = 3
};

std::size_t point_bytes(DataType type) {
  constexpr std::array<std::size_t, 4> kBytes{24, 14, 8, 10};
  return kBytes[static_cast<std::size_t>(type)];
}

/// What one point says, in the laser's frame.
struct LivoxPoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::uint8_t reflectivity = 0;
};

LivoxPoint read_point(LivoxBytes point, DataType type) {
  LivoxPoint result;
  switch (type) {
    case DataType::kCartesian_mm:
      result.position_m = 1e-3 * vector_at<std::int32_t>(point, 0);
      result.reflectivity = point[12];
      break;
    case DataType::kCartesian_cm:
      result.position_m = 1e-2 * vector_at<std::int16_t>(point, 0);
      result.reflectivity = point[6];
      break;
    case DataType::kSpherical: {
      // Theta from the z axis, phi in the plane from x.
      const double range_m = 1e-3 * number_at<std::uint32_t>(point, 0);
      const double theta = kCentidegree * number_at<std::uint16_t>(point, 4);
      const double phi = kCentidegree * number_at<std::uint16_t>(point, 6);
      result.position_m =
          range_m * Eigen::Vector3d(std::sin(theta) * std::cos(phi),
                                    std::sin(theta) * std::sin(phi), std::cos(theta));
      result.reflectivity = point[8];
      break;
    }
    case DataType::kImu:
      break;
  }
  return result;
}

/// Number of lines and range [m] (Mid-360 and HAP user manuals; kLineNumber* of livox_ros_driver2).
std::uint16_t lines_of(LivoxModel model) { return model == LivoxModel::kHap ? 6 : 4; }
double usual_range_m(LivoxModel model) { return model == LivoxModel::kHap ? 200.0 : 100.0; }

std::optional<Fault> livox_fault(LivoxBytes bytes) {
  if (bytes.size() < kDataAt || number_at<std::uint16_t>(bytes, kLengthAt) != bytes.size())
    return Fault::kWrongSize;
  if (bytes[kTypeAt] > static_cast<std::uint8_t>(DataType::kSpherical)) return Fault::kOtherModel;

  const auto type = static_cast<DataType>(bytes[kTypeAt]);
  const auto points = number_at<std::uint16_t>(bytes, kPointsAt);
  const auto time_ns = number_at<std::uint64_t>(bytes, kTimeAt);
  const std::size_t data = type == DataType::kImu ? 1 : points;
  if (bytes.size() != kDataAt + data * point_bytes(type)) return Fault::kWrongSize;
  if (points > kMostPoints || time_ns > static_cast<std::uint64_t>(SensorClock::kLatest_ns))
    return Fault::kDamaged;
  return std::nullopt;
}

}  // namespace

std::optional<LivoxModel> livox_model(std::string_view name) {
  for (const LivoxModel model : {LivoxModel::kMid360, LivoxModel::kHap}) {
    if (name == to_string(model)) return model;
  }
  return std::nullopt;
}

std::string_view to_string(LivoxModel model) {
  return model == LivoxModel::kHap ? "hap" : "mid360";
}

LivoxPorts livox_ports(LivoxModel model) {
  if (model == LivoxModel::kHap) return {57000, 58000};
  return {};
}

bool is_livox_packet(LivoxBytes bytes) { return !livox_fault(bytes); }

LivoxStream::LivoxStream(LivoxModel model, double period_s, double max_range_m)
    : model_(model),
      lines_(lines_of(model)),
      period_ns_(static_cast<std::int64_t>(std::llround(1e9 * period_s))),
      max_range_m_(max_range_m > 0.0 ? max_range_m : usual_range_m(model)),
      builder_(lines_, max_range_m_) {}

std::optional<Eigen::Vector3d> LivoxStream::imu_position_m() const {
  // Mid-360 user manual, "IMU data".
  if (model_ == LivoxModel::kMid360) return Eigen::Vector3d(0.011, 0.02329, -0.04412);
  return std::nullopt;
}

Readings LivoxStream::add(const Packet& packet) {
  Readings readings;
  ++counts_.packets;
  readings.fault = livox_fault(packet.bytes);
  if (!readings.fault) {
    const bool is_imu = packet.bytes[kTypeAt] == static_cast<std::uint8_t>(DataType::kImu);
    is_imu ? add_imu(packet, readings) : add_points(packet, readings);
  }
  if (readings.fault) ++counts_.refused;
  counts_.sweeps += readings.sweeps.size();
  return readings;
}

/// What was gathered before the clock was set is no part of the sweep.
void LivoxStream::take_time(std::int64_t time_ns, model::Utime received) {
  if (clock_.take(time_ns, received) == SensorClock::Step::kNext) return;
  ++counts_.jumps;
  builder_.clear();
  period_.reset();
  latest_ns_ = 0;
}

void LivoxStream::end_sweep(std::vector<model::PointSweep>& sweeps) {
  auto sweep = builder_.take();
  if (sweep && has_begin_) sweeps.push_back(*std::move(sweep));
}

void LivoxStream::add_points(const Packet& packet, Readings& readings) {
  const auto bytes = packet.bytes;
  const auto type = static_cast<DataType>(bytes[kTypeAt]);
  const std::size_t points = number_at<std::uint16_t>(bytes, kPointsAt);
  const auto first_ns = number_at<std::int64_t>(bytes, kTimeAt);
  const double span_ns = 100.0 * number_at<std::uint16_t>(bytes, kIntervalAt);
  take_time(first_ns, packet.received);
  if (first_ns < latest_ns_ - kLargestOverlap_ns) {
    readings.fault = Fault::kLate;
    return;
  }

  const auto number = number_at<std::uint16_t>(bytes, kNumberAt);
  if (packet_number_ && number != 0 && number != static_cast<std::uint16_t>(*packet_number_ + 1))
    ++counts_.gaps;
  packet_number_ = number;

  for (std::size_t i = 0; i < points; ++i) {
    const std::int64_t time_ns =
        first_ns + std::llround(span_ns * static_cast<double>(i) / static_cast<double>(points));
    const std::int64_t period = time_ns / period_ns_;
    if (!period_ || period > *period_) {
      end_sweep(readings.sweeps);
      // Of the first one the begin may be missing.
      has_begin_ = period_.has_value();
      period_ = period;
    }
    latest_ns_ = std::max(latest_ns_, time_ns);
    const LivoxPoint point =
        read_point(bytes.subspan(kDataAt + i * point_bytes(type), point_bytes(type)), type);
    const double range_m = point.position_m.norm();
    if (range_m <= 0.0 || range_m >= max_range_m_) continue;
    builder_.add(point.position_m.cast<float>(), clock_.placed_ns(time_ns),
                 static_cast<std::uint16_t>(i % lines_), point.reflectivity);
  }
}

void LivoxStream::add_imu(const Packet& packet, Readings& readings) {
  constexpr double kMostReading = 1e4;
  const auto time_ns = number_at<std::int64_t>(packet.bytes, kTimeAt);
  model::ImuSample sample;
  sample.angular_rate_rad_s = vector_at<float>(packet.bytes, kDataAt);
  sample.specific_force_mps2 = kGravity_mps2 * vector_at<float>(packet.bytes, kDataAt + 12);
  if (!(sample.angular_rate_rad_s.norm() < kMostReading) ||
      !(sample.specific_force_mps2.norm() < kMostReading)) {
    readings.fault = Fault::kDamaged;
    return;
  }

  take_time(time_ns, packet.received);
  sample.utime = clock_.placed_ns(time_ns) / 1000;
  sample.sequence = imu_samples_++;
  readings.imu.push_back(sample);
}

std::optional<model::PointSweep> LivoxStream::finish() {
  const bool is_mostly_there = latest_ns_ % period_ns_ >= period_ns_ / 2;
  auto sweep = builder_.take();
  if (!sweep || !has_begin_ || !is_mostly_there) return std::nullopt;
  ++counts_.sweeps;
  return sweep;
}

}  // namespace understory::packets
