#include "services/velodyne_driver/velodyne_driver.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace understory::velodyne_driver {
namespace {

std::optional<io::LocalPlane> plane_of(const VelodyneGnssParameters& parameters) {
  if (!parameters.has_origin) return std::nullopt;
  return io::LocalPlane(parameters.origin_latitude_deg, parameters.origin_longitude_deg);
}

wire::Refusal wrong_size(std::size_t size, std::size_t right) {
  return {size < right ? wire::Reason::kTooShort : wire::Reason::kTooLong,
          fmt::format("a packet of {} bytes, not {}", size, right)};
}

bool is_empty_sentence(std::span<const std::uint8_t> packet) {
  constexpr std::size_t kSentenceAt = 206;
  const std::uint8_t first = packet[kSentenceAt];
  return first == 0 || first == '\r' || first == '\n' || first == ' ';
}

}  // namespace

VelodyneDriver::VelodyneDriver(const VelodyneDriverParameters& parameters,
                               io::VelodyneCalibration calibration)
    : parameters_(parameters),
      calibration_(std::move(calibration)),
      decoder_(calibration_, parameters.range.max_range_m),
      fixes_(plane_of(parameters.gnss)) {}

bool VelodyneDriver::refuse(std::span<const std::uint8_t> packet, std::size_t size,
                            std::vector<wire::Refusal>& faults) {
  if (size != packet.size()) packet = {};
  const auto fault = check_velodyne_packet(packet, calibration_.model);
  if (!fault) return false;
  switch (*fault) {
    case io::VelodynePacketFault::kWrongSize:
      ++counts_.wrong_size;
      faults.push_back(wrong_size(size, io::kVelodyneDataBytes));
      break;
    case io::VelodynePacketFault::kOtherModel:
      ++counts_.wrong_model;
      faults.push_back(
          {wire::Reason::kWrongType, fmt::format("a packet that no {} sends (product {:#x})",
                                                 to_string(calibration_.model), packet.back())});
      break;
    case io::VelodynePacketFault::kDamaged:
      ++counts_.damaged;
      faults.push_back({wire::Reason::kInconsistent, "a packet with impossible flags or azimuths"});
      break;
  }
  return true;
}

void VelodyneDriver::start_over() {
  // Incomplete sweeps are numbered, too: numbers must be unique.
  next_revolution_ += decoder_.counts().turns + 1;
  decoder_ = io::VelodyneDecoder(calibration_, parameters_.range.max_range_m);
  holes_reported_ = 0;
}

std::optional<model::PointSweep> VelodyneDriver::stamped(std::optional<model::PointSweep> sweep) {
  if (!sweep) return sweep;
  ++counts_.sweeps;
  sweep->revolution += next_revolution_;
  sweep->sequence = sweep->revolution;
  if (parameters_.time.source == "received") sweep->utime += clock_.offset_us().value_or(0);
  return sweep;
}

lidar_driver::DriverOutput VelodyneDriver::add_data(std::span<const std::uint8_t> packet,
                                                    std::size_t size, model::Utime received) {
  lidar_driver::DriverOutput output;
  ++counts_.data_packets;
  output.is_refused = refuse(packet, size, output.faults);
  if (output.is_refused) return output;

  // Does its time continue the previous one?
  const VelodyneClock::Reading time = clock_.take(io::velodyne_packet_time_us(packet), received);
  switch (time.step) {
    case VelodyneClock::Step::kNext:
      break;
    case VelodyneClock::Step::kLate:
      ++counts_.late;
      output.is_refused = true;
      output.faults.push_back(
          {wire::Reason::kLate, "a packet that is older than the one before it"});
      return output;
    case VelodyneClock::Step::kGap:
      ++counts_.gaps;
      output.faults.push_back(
          {wire::Reason::kPartsMissing, "no packets for a while: a sweep is left out"});
      start_over();
      break;
    case VelodyneClock::Step::kJump:
      ++counts_.jumps;
      output.faults.push_back(
          {wire::Reason::kClockJump, "the sensor's clock jumped: a sweep is left out"});
      start_over();
      break;
  }

  if (auto sweep = stamped(decoder_.add(packet, time.utime)))
    output.sweeps.push_back(*std::move(sweep));
  if (decoder_.counts().lost_azimuth > holes_reported_) {
    holes_reported_ = decoder_.counts().lost_azimuth;
    ++counts_.holes;
    output.faults.push_back(
        {wire::Reason::kPartsMissing, "packets are missing: a sweep has a hole"});
  }
  return output;
}

lidar_driver::DriverOutput VelodyneDriver::add_position(std::span<const std::uint8_t> packet,
                                                        std::size_t size, model::Utime received) {
  lidar_driver::DriverOutput output;
  ++counts_.position_packets;
  if (size != io::kVelodynePositionBytes || packet.size() != size) {
    ++counts_.bad_positions;
    output.faults.push_back(wrong_size(size, io::kVelodynePositionBytes));
    return output;
  }

  const auto position = io::parse_velodyne_position(packet);
  if (position) {
    if (const auto fix = fixes_.add(*position, received)) output.fixes.push_back(*fix);
    counts_.fixes += output.fixes.size();
  } else if (!is_empty_sentence(packet)) {
    ++counts_.bad_positions;
    output.faults.push_back(
        {wire::Reason::kInconsistent, "no GPRMC sentence, or its checksum is wrong"});
  }
  return output;
}

std::optional<model::PointSweep> VelodyneDriver::finish() { return stamped(decoder_.finish()); }

std::string VelodyneDriver::summary(const lidar_driver::SocketCounts& sockets) const {
  const VelodyneDriverCounts& c = counts_;
  return fmt::format(
      "data packets {} (refused: size {}, model {}, damaged {}, late {}; other senders {}; thrown "
      "away by the kernel {}), sweeps {} (with holes {}), gaps {}, clock jumps {}, position "
      "packets {} (bad {}), fixes {}",
      c.data_packets, c.wrong_size, c.wrong_model, c.damaged, c.late, sockets.other_senders,
      sockets.overruns, c.sweeps, c.holes, c.gaps, c.jumps, c.position_packets, c.bad_positions,
      c.fixes);
}

std::optional<wire::Refusal> VelodyneDriver::clock_fault() const {
  const auto offset = clock_.offset_us();
  if (!offset || parameters_.time.source != "sensor") return std::nullopt;
  const double offset_s = 1e-6 * static_cast<double>(*offset);
  if (std::abs(offset_s) <= parameters_.time.tolerance_s) return std::nullopt;
  return lidar_driver::clock_refusal(offset_s, "PPS and NMEA");
}

}  // namespace understory::velodyne_driver
