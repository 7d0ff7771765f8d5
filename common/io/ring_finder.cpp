#include "common/io/ring_finder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

namespace understory::io {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kFewestBeams = 4;
constexpr std::size_t kMostBeams = 256;
constexpr std::size_t kFewestPoints = 200;
/// Beams do not start at the origin: near points have another elevation.
constexpr double kFar_m = 8.0;
/// Share of the far points that may lie between the beams.
constexpr double kMostStray = 0.02;

double elevation(const Eigen::Vector3f& point) {
  return static_cast<double>(std::atan2(point.z(), point.head<2>().norm()));
}

RingTurns turns_between(const std::vector<std::size_t>& wraps, std::size_t points) {
  RingTurns found{{}, wraps.size() + 1};
  found.turn.reserve(points);
  std::uint32_t turn = 0;
  for (std::size_t i = 0; i < points; ++i) {
    if (turn < wraps.size() && wraps[turn] == i) ++turn;
    found.turn.push_back(turn);
  }
  return found;
}

std::optional<FoundRings> rings_by_order(std::span<const Eigen::Vector3f> points,
                                         double begin_rad) {
  const RingTurns order = find_turns(points, begin_rad);
  if (order.turns < kFewestBeams || order.turns > kMostBeams) return std::nullopt;

  // Each turn is one beam if the elevations are monotonic.
  std::vector<double> sum(order.turns, 0.0);
  std::vector<double> count(order.turns, 0.0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum[order.turn[i]] += elevation(points[i]);
    count[order.turn[i]] += 1.0;
  }
  std::size_t upwards = 0;
  for (std::size_t r = 1; r < sum.size(); ++r)
    upwards += sum[r] / std::max(count[r], 1.0) > sum[r - 1] / std::max(count[r - 1], 1.0) ? 1 : 0;
  constexpr double kOneWay = 0.9;
  const double share = static_cast<double>(upwards) / static_cast<double>(sum.size() - 1);
  if (share < kOneWay && share > 1.0 - kOneWay) return std::nullopt;

  FoundRings found{{}, static_cast<std::uint16_t>(order.turns), "the order of the points"};
  found.ring.reserve(points.size());
  const bool is_upwards = share >= kOneWay;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t turn = order.turn[i];
    found.ring.push_back(static_cast<std::uint16_t>(is_upwards ? turn : order.turns - 1 - turn));
  }
  return found;
}

/// The middle of each beam, the lowest first; empty where they are not separated.
std::vector<double> beams_of(std::span<const double> elevations) {
  // A histogram finer than the distance of beams; a beam is a run of non-empty bins.
  constexpr double kBin = 0.02 * kPi / 180.0;
  constexpr double kLowest = -0.5 * kPi;
  const auto bins = static_cast<std::size_t>(kPi / kBin) + 1;
  std::vector<std::uint32_t> count(bins, 0);
  for (const double e : elevations) ++count[static_cast<std::size_t>((e - kLowest) / kBin)];
  const auto least = static_cast<std::uint32_t>(1 + elevations.size() / 20000);

  struct Beam {
    std::size_t first, last;
    std::uint64_t points;
    double sum;
  };
  std::vector<Beam> beams;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    if (count[bin] < least) continue;
    // A beam with few points may have an empty bin by chance.
    if (beams.empty() || bin > beams.back().last + 2) beams.push_back({bin, bin, 0, 0.0});
    beams.back().last = bin;
    beams.back().points += count[bin];
    beams.back().sum += static_cast<double>(count[bin]) * (static_cast<double>(bin) + 0.5);
  }

  std::uint64_t inside = 0;
  for (const Beam& beam : beams) inside += beam.points;
  const auto stray = static_cast<double>(elevations.size() - inside);
  if (beams.size() < kFewestBeams || beams.size() > kMostBeams ||
      stray > kMostStray * static_cast<double>(elevations.size()))
    return {};
  for (std::size_t b = 1; b < beams.size(); ++b) {
    const std::size_t apart = beams[b].first - beams[b - 1].last;
    const std::size_t width =
        std::max(beams[b].last - beams[b].first, beams[b - 1].last - beams[b - 1].first) + 1;
    if (width > 2 * apart) return {};
  }
  std::vector<double> middles;
  middles.reserve(beams.size());
  for (const Beam& beam : beams)
    middles.push_back(kLowest + kBin * beam.sum / static_cast<double>(beam.points));
  return middles;
}

std::optional<FoundRings> rings_by_elevation(std::span<const Eigen::Vector3f> points) {
  std::vector<double> far;
  for (const Eigen::Vector3f& point : points) {
    if (static_cast<double>(point.norm()) > kFar_m) far.push_back(elevation(point));
  }
  if (far.size() < kFewestPoints) return std::nullopt;
  const std::vector<double> beams = beams_of(far);
  if (beams.empty()) return std::nullopt;

  FoundRings found{{}, static_cast<std::uint16_t>(beams.size()), "elevations"};
  found.ring.reserve(points.size());
  for (const Eigen::Vector3f& point : points) {
    const double e = elevation(point);
    const auto above = std::ranges::lower_bound(beams, e);
    auto nearest = above;
    if (above == beams.end() || (above != beams.begin() && e - *std::prev(above) < *above - e))
      nearest = std::prev(above);
    found.ring.push_back(static_cast<std::uint16_t>(nearest - beams.begin()));
  }
  return found;
}

}  // namespace

RingTurns find_turns(std::span<const Eigen::Vector3f> points_m, double begin_rad) {
  std::size_t forward = 0;
  double last = 0.0;
  std::vector<std::size_t> forward_wraps;
  std::vector<std::size_t> backward_wraps;
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const double angle =
        std::atan2(static_cast<double>(points_m[i].y()), static_cast<double>(points_m[i].x()));
    const double azimuth = angle < begin_rad ? angle + 2.0 * kPi : angle;
    if (i > 0) {
      forward += std::remainder(azimuth - last, 2.0 * kPi) > 0.0 ? 1 : 0;
      if (azimuth < last - kPi) forward_wraps.push_back(i);
      if (azimuth > last + kPi) backward_wraps.push_back(i);
    }
    last = azimuth;
  }

  constexpr double kOneSense = 0.9;
  const double share = static_cast<double>(forward) / static_cast<double>(points_m.size());
  if (share > kOneSense) return turns_between(forward_wraps, points_m.size());
  if (share < 1.0 - kOneSense) return turns_between(backward_wraps, points_m.size());
  return {};
}

FoundRings find_rings(std::span<const Eigen::Vector3f> points_m) {
  if (points_m.size() < kFewestPoints) return {};
  // KITTI begins ahead; points sorted by atan2 begin behind. A cut elsewhere adds one ring.
  const auto ahead = rings_by_order(points_m, 0.0);
  const auto behind = rings_by_order(points_m, -kPi);
  if (ahead && (!behind || ahead->rings <= behind->rings)) return *ahead;
  if (behind) return *behind;
  return rings_by_elevation(points_m).value_or(FoundRings{});
}

}  // namespace understory::io
