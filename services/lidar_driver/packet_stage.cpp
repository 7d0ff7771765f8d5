#include "services/lidar_driver/packet_stage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/io/data_error.hpp"

namespace understory::lidar_driver {
namespace {

wire::Reason reason_of(packets::Fault fault, bool is_short) {
  switch (fault) {
    case packets::Fault::kWrongSize:
      return is_short ? wire::Reason::kTooShort : wire::Reason::kTooLong;
    case packets::Fault::kOtherModel:
      return wire::Reason::kWrongType;
    case packets::Fault::kDamaged:
      return wire::Reason::kInconsistent;
    case packets::Fault::kLate:
      return wire::Reason::kLate;
  }
  return wire::Reason::kInconsistent;
}

}  // namespace

wire::Refusal clock_refusal(double offset_s, const std::string& without) {
  return {wire::Reason::kClockJump,
          fmt::format("the sensor's clock is {:.3f} s behind the computer's: without {} set "
                      "time.source = \"received\"",
                      offset_s, without)};
}

PacketStage::PacketStage(packets::Decoder decoder, TimeParameters time)
    : decoder_(std::move(decoder)), time_(std::move(time)) {}

model::Utime PacketStage::offset_us() const {
  return time_.source == "received" ? delay_.offset_us().value_or(0) : 0;
}

void PacketStage::report_new(DriverOutput& output) {
  const packets::StreamCounts& counts = packets::counts(decoder_);
  if (counts.jumps > jumps_reported_) {
    delay_.forget();
    output.faults.push_back(
        {wire::Reason::kClockJump, "the sensor's clock jumped: a sweep is left out"});
  }
  if (counts.gaps > gaps_reported_)
    output.faults.push_back(
        {wire::Reason::kPartsMissing, "packets are missing: a sweep has a hole"});
  jumps_reported_ = counts.jumps;
  gaps_reported_ = counts.gaps;
}

DriverOutput PacketStage::add(std::size_t /*port*/, std::span<const std::uint8_t> bytes,
                              std::size_t size, model::Utime received) {
  DriverOutput output;
  // A truncated packet is decoded as an empty one.
  packets::Readings readings =
      packets::add(decoder_, {size == bytes.size() ? bytes : bytes.first(0), received});
  if (readings.fault) {
    output.is_refused = true;
    ++faults_[static_cast<std::size_t>(*readings.fault)];
    output.faults.push_back(
        {reason_of(*readings.fault, size < largest_good_),
         fmt::format("a packet of {} bytes: {}", size, packets::to_string(*readings.fault))});
    return output;
  }

  largest_good_ = std::max(largest_good_, size);
  report_new(output);
  if (const auto lag = packets::clock(decoder_)->lag_us()) delay_.add(received - *lag, received);
  const model::Utime offset = offset_us();
  for (model::PointSweep& sweep : readings.sweeps) sweep.utime += offset;
  for (model::ImuSample& sample : readings.imu) sample.utime += offset;
  imu_samples_ += readings.imu.size();
  output.sweeps = std::move(readings.sweeps);
  output.imu = std::move(readings.imu);
  output.fixes = std::move(readings.fixes);
  return output;
}

std::optional<model::PointSweep> PacketStage::finish() {
  auto sweep = packets::finish(decoder_);
  if (sweep) sweep->utime += offset_us();
  return sweep;
}

std::optional<wire::Refusal> PacketStage::clock_fault() const {
  const packets::SensorClock& clock = *packets::clock(decoder_);
  const auto offset = delay_.offset_us();
  if (!offset || time_.source != "sensor") return std::nullopt;
  if (clock.moved_ns() != 0)
    return wire::Refusal{
        wire::Reason::kClockJump,
        "the sensor's clock does not show the time of day: without PTP or GNSS set "
        "time.source = \"received\""};
  const double offset_s = 1e-6 * static_cast<double>(*offset);
  if (std::abs(offset_s) <= time_.tolerance_s) return std::nullopt;
  return clock_refusal(offset_s, "PTP or GNSS");
}

PacketStage make_stage(packets::SensorDescription sensor, const std::string& key,
                       const TimeParameters& time) {
  if (!sensor.source.empty()) sensor.description = read_parameter_file(key, sensor.source);
  try {
    return {packets::make_decoder(sensor), time};
  } catch (const io::DataError& error) {
    throw bus::ConfigurationError({key + ": " + error.what()});
  }
}

std::string PacketStage::summary(const SocketCounts& sockets) const {
  const packets::StreamCounts& c = packets::counts(decoder_);
  return fmt::format(
      "packets {} (refused: size {}, model {}, damaged {}, late {}; other senders {}; thrown away "
      "by "
      "the kernel {}), sweeps {}, gaps {}, clock jumps {}, IMU samples {}",
      c.packets, faults_[0], faults_[1], faults_[2], faults_[3], sockets.other_senders,
      sockets.overruns, c.sweeps, c.gaps, c.jumps, imu_samples_);
}

}  // namespace understory::lidar_driver
