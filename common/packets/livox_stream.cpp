#include "common/packets/livox_stream.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/packets/bytes.hpp"

namespace understory::packets {
namespace {

/// Largest overlap of a packet's first point with the end of the previous packet.
constexpr std::int64_t kLargestOverlap_ns = 2'000'000;

constexpr double kGravity_mps2 = 9.80665;  // IMU packets: rad/s and g

}  // namespace

LivoxPorts livox_ports(LivoxModel model) {
  if (model == LivoxModel::kHap) return {57000, 58000};
  return speaks_sdk1(model) ? LivoxPorts{0, 0} : LivoxPorts{};
}

LivoxStream::LivoxStream(LivoxModel model, double period_s, double max_range_m)
    : model_(model),
      properties_(livox_properties(model)),
      period_ns_(static_cast<std::int64_t>(std::llround(1e9 * period_s))),
      max_range_m_(max_range_m > 0.0 ? max_range_m : properties_.range_m),
      builder_(properties_.lines, max_range_m_) {}

std::optional<Eigen::Vector3d> LivoxStream::imu_position_m() const {
  // Mid-360 user manual, "IMU data".
  if (model_ == LivoxModel::kMid360) return Eigen::Vector3d(0.011, 0.02329, -0.04412);
  return std::nullopt;
}

Readings LivoxStream::add(const Packet& packet) {
  Readings readings;
  ++counts_.packets;
  const auto read = read_livox_header(model_, packet.bytes, packet.received);
  if (const auto* const header = std::get_if<LivoxHeader>(&read)) {
    header->is_imu ? add_imu(packet, *header, readings) : add_points(packet, *header, readings);
  } else {
    readings.fault = std::get<Fault>(read);
  }
  if (readings.fault) ++counts_.refused;
  counts_.sweeps += readings.sweeps.size();
  return readings;
}

/// Points collected before the clock was set are not part of the sweep.
void LivoxStream::take_time(std::int64_t time_ns, model::Utime received) {
  if (clock_.take(time_ns, received) == SensorClock::Step::kNext) return;
  ++counts_.jumps;
  builder_.clear();
  period_.reset();
  latest_ns_ = 0;
  next_ns_.reset();
}

void LivoxStream::end_sweep(std::vector<model::PointSweep>& sweeps) {
  auto sweep = builder_.take();
  if (sweep && has_begin_) sweeps.push_back(*std::move(sweep));
}

void LivoxStream::count_gap(const LivoxHeader& header) {
  const auto expected = static_cast<std::uint16_t>(packet_number_.value_or(0) + 1);
  const bool is_number_missing =
      header.number && packet_number_ && *header.number != 0 && *header.number != expected;
  // SDK1 packets have no number, but follow each other without a pause.
  const std::int64_t span_ns = std::llround(header.span_ns);
  const bool is_time_missing =
      !header.number && next_ns_ && header.time_ns > *next_ns_ + span_ns / 2;
  if (is_number_missing || is_time_missing) ++counts_.gaps;
  packet_number_ = header.number;
  next_ns_ = header.time_ns + span_ns;
}

void LivoxStream::add_points(const Packet& packet, const LivoxHeader& header, Readings& readings) {
  take_time(header.time_ns, packet.received);
  if (header.time_ns < latest_ns_ - kLargestOverlap_ns) {
    readings.fault = Fault::kLate;
    return;
  }
  count_gap(header);

  const std::size_t bytes = header.layout.bytes;
  for (std::size_t i = 0; i < header.shots; ++i) {
    const std::int64_t time_ns =
        header.time_ns +
        std::llround(header.span_ns * static_cast<double>(i) / static_cast<double>(header.shots));
    const std::int64_t period = time_ns / period_ns_;
    if (!period_ || period > *period_) {
      end_sweep(readings.sweeps);
      // The begin of the first sweep may be missing.
      has_begin_ = period_.has_value();
      period_ = period;
    }
    latest_ns_ = std::max(latest_ns_, time_ns);
    const auto shot = packet.bytes.subspan(header.data_at + i * bytes, bytes);
    for (std::size_t which = 0; which < header.layout.returns; ++which) {
      const LivoxReturn point = read_livox_return(shot, header.layout, which);
      const double range_m = point.position_m.norm();
      if (range_m <= 0.0 || range_m >= max_range_m_) continue;
      builder_.add(point.position_m.cast<float>(), clock_.placed_ns(time_ns),
                   static_cast<std::uint16_t>(i % properties_.lines), point.reflectivity);
    }
  }
}

void LivoxStream::add_imu(const Packet& packet, const LivoxHeader& header, Readings& readings) {
  constexpr double kMostReading = 1e4;
  model::ImuSample sample;
  sample.angular_rate_rad_s = vector_at<float>(packet.bytes, header.data_at);
  sample.specific_force_mps2 = kGravity_mps2 * vector_at<float>(packet.bytes, header.data_at + 12);
  if (!(sample.angular_rate_rad_s.norm() < kMostReading) ||
      !(sample.specific_force_mps2.norm() < kMostReading)) {
    readings.fault = Fault::kDamaged;
    return;
  }

  take_time(header.time_ns, packet.received);
  sample.utime = clock_.placed_ns(header.time_ns) / 1000;
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
