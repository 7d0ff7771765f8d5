// make_stem_way and fit_stem_way of sim/stem_frames.hpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "sim/point_grid.hpp"
#include "sim/random_streams.hpp"
#include "sim/stem_frames.hpp"

namespace understory::sim {
namespace {

constexpr double kEdgeM = 8.0;
constexpr double kLeastWidthM = 50.0;
constexpr double kRoundingM = 8.0;
/// Distance of laps and of the way back from the first way, on either side.
constexpr double kBesideM = 1.0;
constexpr int kCorners = 7;
constexpr int kMostDraws = 20000;

constexpr std::array<std::pair<StemWay, std::string_view>, 3> kWayNames{
    {{StemWay::kLaps, "laps"},
     {StemWay::kThereAndBack, "there-and-back"},
     {StemWay::kWander, "wander"}}};

using WayPoints = std::vector<Eigen::Vector2d>;

double length_of(const WayPoints& points) {
  double length = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

/// The part of a forest for paths: away from its edges, with stems around.
class WayBox {
 public:
  explicit WayBox(const Forest& forest)
      : low_m_(forest.low_m.array() + kEdgeM),
        high_m_(forest.high_m.array() - kEdgeM),
        grid_(forest.trunks_m, kAroundM) {
    if ((forest.high_m - forest.low_m).minCoeff() < kLeastWidthM)
      throw std::runtime_error("the forest is less than 50 m wide: too small for a way in it");
    double sum = 0.0;
    const std::size_t step = 1 + forest.trunks_m.size() / kSamples;
    std::size_t count = 0;
    for (std::size_t i = 0; i < forest.trunks_m.size(); i += step, ++count)
      sum += static_cast<double>(grid_.within(forest.trunks_m[i], kAroundM).size());
    least_around_ = kLeastShare * sum / static_cast<double>(count);
  }

  Eigen::Vector2d size_m() const { return high_m_ - low_m_; }
  Eigen::Vector2d centre_m() const { return 0.5 * (low_m_ + high_m_); }
  Eigen::Vector2d clamped(const Eigen::Vector2d& point_m) const {
    return point_m.cwiseMax(low_m_).cwiseMin(high_m_);
  }
  /// A random position among stems.
  Eigen::Vector2d draw(std::mt19937_64& random) const {
    for (int i = 0; i < kTries; ++i) {
      const double x = uniform(random, low_m_.x(), high_m_.x());
      Eigen::Vector2d place(x, uniform(random, low_m_.y(), high_m_.y()));
      if (has_stems(place)) return place;
    }
    throw std::runtime_error("no place for a way among the stems was found");
  }
  /// Whether there are stems along the whole line.
  bool is_among_stems(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m) const {
    const auto steps = static_cast<int>(std::ceil((to_m - from_m).norm() / kSampleM));
    for (int i = 0; i <= steps; ++i) {
      if (!has_stems(from_m + (to_m - from_m) * (static_cast<double>(i) / std::max(1, steps))))
        return false;
    }
    return true;
  }

 private:
  static constexpr double kAroundM = 20.0;
  static constexpr double kSampleM = 8.0;
  static constexpr double kLeastShare = 0.4;
  static constexpr std::size_t kSamples = 500;
  static constexpr int kTries = 10000;

  bool has_stems(const Eigen::Vector2d& place_m) const {
    return static_cast<double>(grid_.within(place_m, kAroundM).size()) >= least_around_;
  }

  Eigen::Vector2d low_m_;
  Eigen::Vector2d high_m_;
  PointGrid grid_;
  double least_around_ = 0.0;
};

/// Corners of a closed path round the middle: a star-shaped polygon that fits the box.
WayPoints star_polygon(const WayBox& box, double length_m, std::mt19937_64& random) {
  WayPoints corners;
  corners.reserve(kCorners);
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * std::numbers::pi * (i + uniform(random, -0.25, 0.25)) / kCorners;
    const double reach = uniform(random, 0.15, 1.0);
    corners.push_back(
        box.centre_m() +
        reach * 0.5 * box.size_m().cwiseProduct(Eigen::Vector2d(std::cos(angle), std::sin(angle))));
  }

  WayPoints closed = corners;
  closed.push_back(corners.front());
  const double shrink = std::min(1.0, 0.5 * length_m / length_of(closed));
  for (Eigen::Vector2d& corner : corners)
    corner = box.centre_m() + shrink * (corner - box.centre_m());
  return corners;
}

WayPoints closed_way(const WayBox& box, double length_m, std::mt19937_64& random) {
  for (int i = 0; i < kMostDraws; ++i) {
    WayPoints corners = star_polygon(box, length_m, random);
    bool is_good = true;
    for (std::size_t k = 0; k < corners.size() && is_good; ++k)
      is_good = box.is_among_stems(corners[k], corners[(k + 1) % corners.size()]);
    if (is_good) return corners;
  }
  throw std::runtime_error("no closed way among the stems was found");
}

WayPoints lap_points(const WayBox& box, double length_m, std::mt19937_64& random) {
  const WayPoints corners = closed_way(box, length_m, random);
  WayPoints points;
  for (std::size_t i = 0; length_of(points) < length_m; ++i) {
    const double beside = i < corners.size() ? 0.0 : uniform(random, -kBesideM, kBesideM);
    points.push_back(box.clamped(corners[i % corners.size()] + Eigen::Vector2d(beside, -beside)));
  }
  return points;
}

WayPoints wander_points(const WayBox& box, double length_m, std::mt19937_64& random) {
  WayPoints points{box.draw(random)};
  for (int i = 0; i < kMostDraws && length_of(points) < length_m; ++i) {
    const Eigen::Vector2d next = box.draw(random);
    if ((next - points.back()).norm() > 4.0 * kRoundingM && box.is_among_stems(points.back(), next))
      points.push_back(next);
  }
  if (points.size() < 2) throw std::runtime_error("no way among the stems was found");
  return points;
}

/// The points, then a turn, then the points in reverse order on the left side of the path.
WayPoints there_and_back_points(const WayBox& box, double length_m, std::mt19937_64& random) {
  const WayPoints there = wander_points(box, 0.5 * length_m, random);
  const Route way = Route::through(there, kRoundingM);
  WayPoints points = way.places(2.0 * kRoundingM);
  const geometry::SE2 end = way.pose(way.length_m());
  const double ahead = kRoundingM;
  points.push_back(box.clamped(end * Eigen::Vector2d(ahead, 0.0)));
  points.push_back(box.clamped(end * Eigen::Vector2d(ahead, ahead)));
  for (double along = way.length_m(); along > 0.0; along -= 2.0 * kRoundingM)
    points.push_back(way.pose(along) * Eigen::Vector2d(0.0, kBesideM));
  return points;
}

}  // namespace

std::optional<StemWay> stem_way(std::string_view name) {
  for (const auto& [value, known] : kWayNames) {
    if (known == name) return value;
  }
  return std::nullopt;
}

std::vector<std::string> stem_way_names() {
  std::vector<std::string> names;
  names.reserve(kWayNames.size());
  for (const auto& [value, name] : kWayNames) names.emplace_back(name);
  return names;
}

Route make_stem_way(StemWay kind, const Forest& forest, double length_m, std::uint64_t seed) {
  const WayBox box(forest);
  std::mt19937_64 random = random_stream(seed, Stream::kStartPose);
  switch (kind) {
    case StemWay::kLaps:
      return Route::through(lap_points(box, length_m, random), kRoundingM);
    case StemWay::kThereAndBack:
      return Route::through(there_and_back_points(box, length_m, random), kRoundingM);
    case StemWay::kWander:
      return Route::through(wander_points(box, length_m, random), kRoundingM);
  }
  throw std::runtime_error("no such way");
}

Route fit_stem_way(std::span<const Eigen::Vector2d> recorded_m, const Forest& forest) {
  if (recorded_m.size() < 2) throw std::runtime_error("a way has at least two places");
  const WayBox box(forest);
  Eigen::Vector2d low = recorded_m.front(), high = recorded_m.front();
  for (const Eigen::Vector2d& point : recorded_m) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }

  const Eigen::Vector2d size = (high - low).cwiseMax(1e-3);
  const double scale = std::min(1.0, box.size_m().cwiseQuotient(size).minCoeff());
  WayPoints points;
  points.reserve(recorded_m.size());
  for (const Eigen::Vector2d& point : recorded_m)
    points.push_back(box.centre_m() + scale * (point - 0.5 * (low + high)));
  return Route::through(points, 1.0);
}

}  // namespace understory::sim
