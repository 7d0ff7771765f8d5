#include "common/packets/hesai_stream.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <numeric>
#include <utility>

#include "common/packets/bytes.hpp"

namespace understory::packets {
namespace {

using HesaiBytes = std::span<const std::uint8_t>;

constexpr int kTurn = 36000;  // hundredths of a degree
/// Largest step of the azimuth between firings; more is a gap. XT32 at 20 Hz, dual: 36 in 50 us.
constexpr int kLargestStep = 600;
/// A longer pause separates two turns.
constexpr std::int64_t kLongestPause_ns = 50'000'000;
constexpr double kRadPerHundredth = 2.0 * std::numbers::pi / kTurn;
constexpr std::size_t kMostBlocks = 10;

int forward(int from, int to) { return (to - from + kTurn) % kTurn; }

/// Year (since 1900 or 2000), month, day, hour, minute, second; where the year is 0, the last four
/// bytes are seconds since 1970, the highest first (HesaiLidar_SDK_2.0, GetMicroLidarTimeU64()).
std::optional<std::int64_t> seconds_of(HesaiBytes date) {
  if (date[0] == 0) {
    std::uint32_t seconds = 0;
    for (std::size_t i = 2; i < 6; ++i) seconds = (seconds << 8U) | date[i];
    return seconds;
  }
  const int year = 1900 + date[0] + (date[0] < 100 ? 100 : 0);
  const std::chrono::year_month_day day{std::chrono::year(year), std::chrono::month(date[1]),
                                        std::chrono::day(date[2])};
  if (!day.ok() || date[3] > 23 || date[4] > 59 || date[5] > 60) return std::nullopt;
  const auto days = std::chrono::sys_days(day).time_since_epoch().count();
  return ((static_cast<std::int64_t>(days) * 24 + date[3]) * 60 + date[4]) * 60 + date[5];
}

}  // namespace

/// Values of a packet beside its points.
struct HesaiStream::Head {
  std::array<int, kMostBlocks> azimuth{};  ///< Azimuth of each block.
  std::size_t returns = 1;                 ///< Blocks of each firing.
  double unit_m = 0.004;                   ///< Unit of distances.
  std::int64_t time_ns = 0;                ///< Sensor's clock.
};

/// One firing of all beams.
struct HesaiStream::Firing {
  std::size_t block = 0;  ///< Its first block.
  int azimuth = 0;
  std::int64_t time_ns = 0;  ///< Time on the computer's clock.
};

HesaiStream::HesaiStream(HesaiModel model, std::vector<HesaiBeam> beams, double max_range_m)
    : model_(model),
      format_(hesai_format(model)),
      beams_(std::move(beams)),
      max_range_m_(max_range_m > 0.0 ? max_range_m : format_.max_range_m),
      builder_(static_cast<std::uint16_t>(format_.beams), max_range_m_),
      rings_(format_.beams),
      order_(format_.beams) {
  std::iota(order_.begin(), order_.end(), 0);
  std::ranges::stable_sort(order_, {}, [&](std::size_t b) { return beams_.at(b).elevation_rad; });
  for (std::size_t ring = 0; ring < order_.size(); ++ring)
    rings_[order_[ring]] = static_cast<std::uint16_t>(ring);
}

std::optional<Fault> HesaiStream::read_head(HesaiBytes bytes, Head& head) const {
  if (bytes.size() != format_.packet(false) && bytes.size() != format_.packet(true))
    return Fault::kWrongSize;
  if (recognise_hesai(bytes) != model_) return Fault::kOtherModel;
  // `DistUnit` in the header [mm]; Pandar40P: 4 mm.
  if (format_.header > 0) head.unit_m = 1e-3 * bytes[format_.header == 8 ? 5 : 9];

  for (std::size_t b = 0; b < format_.blocks; ++b) {
    const std::size_t at = format_.header + b * format_.block();
    if (format_.header == 0 && (bytes[at] != 0xFF || bytes[at + 1] != 0xEE)) return Fault::kDamaged;
    head.azimuth[b] = number_at<std::uint16_t>(bytes, at + format_.azimuth_at);
    if (head.azimuth[b] >= kTurn) return Fault::kDamaged;
  }
  while (head.returns < 3 && head.returns < format_.blocks &&
         head.azimuth[head.returns] == head.azimuth[0])
    ++head.returns;
  if (format_.blocks % head.returns != 0) head.returns = 1;

  const std::size_t tail = format_.header + format_.blocks * format_.block();
  const auto seconds = seconds_of(bytes.subspan(tail + format_.date_at, 6));
  const auto past_us = number_at<std::uint32_t>(bytes, tail + format_.time_at);
  constexpr std::uint32_t kMostPast_us = 2'000'000;
  if (!seconds || past_us > kMostPast_us || !(head.unit_m > 0.0)) return Fault::kDamaged;
  head.time_ns = *seconds * 1'000'000'000 + static_cast<std::int64_t>(past_us) * 1000;
  if (head.time_ns < 0 || head.time_ns > SensorClock::kLatest_ns) return Fault::kDamaged;
  return std::nullopt;
}

void HesaiStream::end_turn(std::vector<model::PointSweep>& sweeps) {
  auto sweep = builder_.take();
  // Points before the first passage of azimuth zero are an incomplete revolution.
  const bool is_whole = std::exchange(has_begin_, true);
  if (sweep && is_whole) sweeps.push_back(*std::move(sweep));
}

/// Drops collected points that are not part of the next turn.
void HesaiStream::start_over() {
  builder_.clear();
  has_begin_ = false;
  last_azimuth_ = -1;
}

Readings HesaiStream::add(const Packet& packet) {
  Readings readings;
  ++counts_.packets;
  Head head;
  readings.fault = read_head(packet.bytes, head);
  if (readings.fault) {
    ++counts_.refused;
    return readings;
  }
  if (clock_.take(head.time_ns, packet.received) == SensorClock::Step::kJump) {
    ++counts_.jumps;
    start_over();
  } else if (last_azimuth_ >= 0 && std::abs(head.time_ns - last_ns_) > kLongestPause_ns) {
    ++counts_.gaps;
    start_over();
  }
  last_ns_ = head.time_ns;

  const std::size_t firings = format_.blocks / head.returns;
  for (std::size_t f = 0; f < firings; ++f) {
    const std::size_t block = f * head.returns;
    const double blocks_from_time = format_.is_timed_from_last
                                        ? static_cast<double>(f) - static_cast<double>(firings - 1)
                                        : static_cast<double>(f);
    const double start_us = format_.first_block_us + format_.block_us * blocks_from_time;
    const Firing firing{block, head.azimuth[block],
                        clock_.placed_ns(head.time_ns) + std::llround(1e3 * start_us)};
    if (f + 1 < firings) {
      const int step = forward(firing.azimuth, head.azimuth[block + head.returns]);
      if (step < kLargestStep) azimuth_rate_ = step / format_.block_us;
    }

    if (last_azimuth_ >= 0 && forward(last_azimuth_, firing.azimuth) > kLargestStep) ++counts_.gaps;
    if (last_azimuth_ - firing.azimuth > kTurn / 2) end_turn(readings.sweeps);
    last_azimuth_ = firing.azimuth;
    add_firing(packet.bytes, head, firing);
  }
  counts_.sweeps += readings.sweeps.size();
  return readings;
}

void HesaiStream::add_firing(HesaiBytes bytes, const Head& head, const Firing& firing) {
  for (const std::size_t beam : order_) {
    const double after_us = format_.firing_us[beam];
    const double azimuth =
        kRadPerHundredth * (firing.azimuth + azimuth_rate_ * after_us) + beams_[beam].azimuth_rad;
    const double elevation = beams_[beam].elevation_rad;
    const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                    -std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    const std::int64_t time_ns = firing.time_ns + std::llround(1e3 * after_us);

    std::array<std::uint16_t, 3> distances{};
    for (std::size_t r = 0; r < head.returns; ++r) {
      const std::size_t at = format_.header + (firing.block + r) * format_.block() +
                             format_.channels_at + beam * format_.channel;
      distances[r] = number_at<std::uint16_t>(bytes, at);
      const double range_m = distances[r] * head.unit_m;
      const bool is_new = std::find(distances.begin(), distances.begin() + static_cast<long>(r),
                                    distances[r]) == distances.begin() + static_cast<long>(r);
      if (distances[r] == 0 || range_m >= max_range_m_ || !is_new) continue;
      builder_.add((range_m * direction).cast<float>(), time_ns, rings_[beam], bytes[at + 2]);
    }
  }
}

std::optional<model::PointSweep> HesaiStream::finish() {
  const bool is_almost_whole = last_azimuth_ >= kTurn - kLargestStep;
  auto sweep = builder_.take();
  if (!sweep || !has_begin_ || !is_almost_whole) return std::nullopt;
  ++counts_.sweeps;
  return sweep;
}

}  // namespace understory::packets
