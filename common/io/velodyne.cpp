#include "common/io/velodyne.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace understory::io {
namespace {

constexpr std::size_t kBlocks = 12;
constexpr std::size_t kBlockBytes = 100;
constexpr std::size_t kPacketTimeAt = 1200;
constexpr std::size_t kProductAt = 1205;
constexpr std::uint16_t kUpperFlag = 0xEEFF;
constexpr std::uint16_t kLowerFlag = 0xDDFF;
constexpr int kTurn = 36000;  // hundredths of a degree
constexpr double kHour_us = 3.6e9;
constexpr std::size_t kMostPointsPerSweep =
    2'000'000;  // longest revolution; a packet stream without azimuth zero ends here
constexpr int kLargestStep = 600;  // largest step of the azimuth between packets

std::uint16_t little_endian_word(std::span<const std::uint8_t> packet, std::size_t at) {
  return static_cast<std::uint16_t>(packet[at] | (packet[at + 1] << 8U));
}

std::uint32_t little_endian_long_word(std::span<const std::uint8_t> packet, std::size_t at) {
  return little_endian_word(packet, at) |
         (static_cast<std::uint32_t>(little_endian_word(packet, at + 2)) << 16U);
}

/// Layout of a model's firings in a packet.
struct Layout {
  std::size_t beams = 16;
  std::size_t blocks_per_firing = 1;
  std::size_t firings_per_block = 1;
  double firing_us = 55.296;  ///< Time between two firings of all beams.
  double beam_us = 2.304;     ///< Time between two shots.
  std::size_t beams_per_shot = 1;
  std::uint8_t product = 0;
};

Layout layout_of(VelodyneModel model) {
  switch (model) {
    case VelodyneModel::kVlp16:
      return {16, 1, 2, 55.296, 2.304, 1, 0x22};
    case VelodyneModel::kVlp32c:
      return {32, 1, 1, 55.296, 2.304, 2, 0x28};
    case VelodyneModel::kHdl32e:
      return {32, 1, 1, 46.080, 1.152, 1, 0x21};
    case VelodyneModel::kHdl64e:
      break;
  }
  return {64, 2, 1, 48.0, 1.5, 1, 0};
}

bool is_other_product(const Layout& layout, std::uint8_t product) {
  if (layout.product == 0 || product == layout.product) return false;
  const bool known = product == 0x21 || product == 0x22 || product == 0x28;
  // Puck Hi-Res and Alpha Prime have other beam angles. Old HDL-32E use this byte for other values.
  const bool foreign = product == 0x24 || product == 0x63 || product == 0xA1;
  return known || (foreign && layout.product != 0x21);
}

int azimuth_between(int from, int to) { return (to - from + kTurn) % kTurn; }

}  // namespace

std::optional<VelodynePacketFault> check_velodyne_packet(std::span<const std::uint8_t> packet,
                                                         VelodyneModel model) {
  const Layout layout = layout_of(model);
  if (packet.size() != kVelodyneDataBytes) return VelodynePacketFault::kWrongSize;
  if (is_other_product(layout, packet[kProductAt])) return VelodynePacketFault::kOtherModel;
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const std::uint16_t flag = little_endian_word(packet, b * kBlockBytes);
    if (flag != kUpperFlag && flag != kLowerFlag) return VelodynePacketFault::kDamaged;
    if (little_endian_word(packet, b * kBlockBytes + 2) >= kTurn)
      return VelodynePacketFault::kDamaged;
    const bool lower = layout.blocks_per_firing == 2 && b % 2 == 1;
    if (flag != (lower ? kLowerFlag : kUpperFlag)) return VelodynePacketFault::kOtherModel;
  }
  return std::nullopt;
}

std::uint32_t velodyne_packet_time_us(std::span<const std::uint8_t> packet) {
  return little_endian_long_word(packet, kPacketTimeAt);
}

/// A checked block of a packet.
struct VelodyneDecoder::Block {
  std::array<int, kBlocks> azimuth{};
  bool is_dual = false;
  double packet_us = 0.0;
};

VelodyneDecoder::VelodyneDecoder(VelodyneCalibration calibration, double max_range_m)
    : calibration_(std::move(calibration)), max_range_m_(max_range_m) {
  if (max_range_m_ <= 0.0)
    max_range_m_ = calibration_.model == VelodyneModel::kVlp32c ? 200.0 : 120.0;
  order_.resize(calibration_.beams.size());
  for (std::size_t beam = 0; beam < order_.size(); ++beam) order_[calibration_.rings[beam]] = beam;
  for (std::size_t i = 0; i < sine_.size(); ++i) {
    const double angle = static_cast<double>(i) * std::numbers::pi / 18000.0;
    sine_[i] = static_cast<float>(std::sin(angle));
    cosine_[i] = static_cast<float>(std::cos(angle));
  }
}

std::optional<model::PointSweep> VelodyneDecoder::take_revolution() {
  model::PointSweep sweep = std::exchange(sweep_, {});
  const bool whole = std::exchange(revolution_started_, true);
  if (sweep.points.empty()) return std::nullopt;
  sweep.rings = static_cast<std::uint16_t>(calibration_.beams.size());
  sweep.max_range_m = max_range_m_;
  sweep.revolution = revolutions_;
  sweep.sequence = revolutions_++;
  // Points before the first passage of azimuth zero are an incomplete revolution.
  if (!whole) return std::nullopt;
  ++counts_.turns;
  return sweep;
}

std::optional<model::PointSweep> VelodyneDecoder::finish() {
  if (last_azimuth_ < kTurn - kLargestStep)
    revolution_started_ = false;  // it did not reach its end
  return take_revolution();
}

std::optional<model::PointSweep> VelodyneDecoder::add(std::span<const std::uint8_t> packet,
                                                      model::Utime received) {
  const Layout layout = layout_of(calibration_.model);
  ++counts_.packets;
  if (check_velodyne_packet(packet, calibration_.model)) {
    ++counts_.refused;
    return std::nullopt;
  }
  Block block;
  for (std::size_t b = 0; b < kBlocks; ++b)
    block.azimuth[b] = little_endian_word(packet, b * kBlockBytes + 2);
  const double past_hour = static_cast<double>(velodyne_packet_time_us(packet));
  const double hours = std::round((static_cast<double>(received) - past_hour) / kHour_us);
  block.packet_us = hours * kHour_us + past_hour;
  block.is_dual = block.azimuth[layout.blocks_per_firing] == block.azimuth[0];

  if (last_azimuth_ >= 0 && azimuth_between(last_azimuth_, block.azimuth[0]) > kLargestStep)
    ++counts_.lost_azimuth;
  // The revolution ends at the first block after azimuth zero; the rest of the packet belongs to
  // the next one.
  std::optional<model::PointSweep> sweep;
  if ((last_azimuth_ > block.azimuth[0] && last_azimuth_ - block.azimuth[0] > kTurn / 2) ||
      sweep_.points.size() > kMostPointsPerSweep)
    sweep = take_revolution();
  add_block(packet, block);
  if (!pending_.points.empty()) {
    if (!sweep) sweep = take_revolution();
    sweep_ = std::exchange(pending_, {});
  }
  last_azimuth_ = block.azimuth[kBlocks - 1];
  return sweep;
}

void VelodyneDecoder::add_block(std::span<const std::uint8_t> packet, const Block& block) {
  const Layout layout = layout_of(calibration_.model);
  const std::size_t returns = block.is_dual ? 2 : 1;
  const std::size_t stride = layout.blocks_per_firing * returns;  // blocks between firings
  model::PointSweep* sweep = &sweep_;

  for (std::size_t b = 0; b + stride <= kBlocks; b += stride) {
    const std::size_t firing = b / stride * layout.firings_per_block;
    const double block_us = static_cast<double>(firing) * layout.firing_us;
    if (b + stride < kBlocks) {
      const double span_us = static_cast<double>(layout.firings_per_block) * layout.firing_us;
      const int step = azimuth_between(block.azimuth[b], block.azimuth[b + stride]);
      if (step < kLargestStep) azimuth_rate_ = step / span_us;
    }

    if (b > 0 && block.azimuth[b - stride] - block.azimuth[b] > kTurn / 2) sweep = &pending_;
    for (std::size_t f = 0; f < layout.firings_per_block; ++f) {
      const double firing_us = static_cast<double>(f) * layout.firing_us;
      for (const std::size_t beam : order_) {
        const std::size_t shot = beam % 32 / layout.beams_per_shot;
        const double shot_us = firing_us + static_cast<double>(shot) * layout.beam_us;
        const double azimuth = block.azimuth[b] + azimuth_rate_ * shot_us;
        const std::size_t channel =
            layout.firings_per_block * layout.beams > 32 ? beam % 32 : f * layout.beams + beam;
        std::uint16_t first = 0;

        for (std::size_t r = 0; r < returns; ++r) {
          const std::size_t at =
              (b + r * layout.blocks_per_firing + beam / 32) * kBlockBytes + 4 + 3 * channel;
          const std::uint16_t distance = little_endian_word(packet, at);
          if (distance == 0 || (r == 1 && distance == first)) continue;
          first = distance;
          add_point(*sweep, {beam, azimuth, distance, packet[at + 2],
                             block.packet_us + block_us + shot_us});
        }
      }
    }
  }
}

void VelodyneDecoder::add_point(model::PointSweep& sweep, const Reading& reading) {
  const VelodyneBeam& beam = calibration_.beams[reading.beam];
  const double range = reading.distance * calibration_.distance_step_m + beam.distance_correction_m;
  if (range <= 0.0 || range >= max_range_m_) return;

  const double hundredths =
      reading.azimuth + beam.azimuth_rad * static_cast<double>(kTurn) / (2.0 * std::numbers::pi);
  const auto index = static_cast<std::size_t>(
      (static_cast<long>(std::lround(hundredths)) % kTurn + kTurn) % kTurn);
  const double flat =
      range * std::cos(beam.elevation_rad) - beam.vertical_offset_m * std::sin(beam.elevation_rad);

  if (sweep.points.empty()) {
    sweep.utime = static_cast<model::Utime>(std::floor(reading.utime));
    sweep.points.reserve(calibration_.beams.size() * 2000);
  }

  model::SweepPoint point;
  const auto forward = static_cast<float>(flat);
  const auto side = static_cast<float>(beam.horizontal_offset_m);

  // Clockwise from the x axis; a positive horizontal offset is to the left.
  point.x_m = forward * cosine_[index] + side * sine_[index];
  point.y_m = -forward * sine_[index] + side * cosine_[index];
  point.z_m = static_cast<float>(range * std::sin(beam.elevation_rad) +
                                 beam.vertical_offset_m * std::cos(beam.elevation_rad));
  point.time_s =
      static_cast<float>(std::max(0.0, (reading.utime - static_cast<double>(sweep.utime)) * 1e-6));
  point.ring = calibration_.rings[reading.beam];
  point.intensity = reading.intensity;
  sweep.points.push_back(point);
}

}  // namespace understory::io
