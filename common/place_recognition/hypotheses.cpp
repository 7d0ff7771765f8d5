#include "common/place_recognition/hypotheses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/geometry/alignment.hpp"

namespace understory::place_recognition {
namespace {

/// Hypotheses of one frame within this distance are one [m], [rad].
constexpr double kSamePlaceM = 0.8;
constexpr double kSameHeadingRad = 0.08;
constexpr int kClustersPerFrame = 2;
constexpr std::size_t kMostHypotheses = 400;
/// A distance beyond the reach by this factor is beyond it at any rounding.
constexpr double kSurelyFarther = 1.0 + 1e-6;

constellation::Triangle indexed(const StemTriangle& triangle, constellation::Slot first) {
  constellation::Triangle result;
  result.side_m = triangle.side_m;
  result.left = triangle.is_left;
  for (std::size_t i = 0; i < 3; ++i) result.vertex[i] = first + triangle.corner[i];
  return result;
}

/// Logarithm of metres; NaN where unknown.
float log_of(double diameter_m) {
  return diameter_m > 0.0 ? static_cast<float>(std::log(diameter_m))
                          : std::numeric_limits<float>::quiet_NaN();
}

float heading_between(const Hypothesis& a, const Hypothesis& b) {
  return std::abs(std::remainder(a.heading_rad - b.heading_rad, 2.0F * std::numbers::pi_v<float>));
}

bool same_place(const Hypothesis& a, const Hypothesis& b) {
  const float dx = a.x_m - b.x_m;
  const float dy = a.y_m - b.y_m;
  return dx * dx + dy * dy < kSamePlaceM * kSamePlaceM && heading_between(a, b) < kSameHeadingRad;
}

using Corners = std::array<Eigen::Vector2d, 3>;

/// Squared distance between the frames by these corners [m^2], equal to that of align_rigid()
/// except for rounding, but without trigonometric functions. Most similar triangles are farther
/// apart than the search allows.
double about_m2(const Corners& frame, const Corners& query) {
  const Eigen::Vector2d frame_m = (frame[0] + frame[1] + frame[2]) / 3.0;
  const Eigen::Vector2d query_m = (query[0] + query[1] + query[2]) / 3.0;
  double dot = 0.0;
  double cross = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector2d a = frame[i] - frame_m;
    const Eigen::Vector2d b = query[i] - query_m;
    dot += a.dot(b);
    cross += b.x() * a.y() - b.y() * a.x();
  }
  const double length = std::sqrt(dot * dot + cross * cross);
  if (length == 0.0) return 0.0;  // No heading is determined: left to align_rigid().
  const Eigen::Vector2d turned_m(dot * query_m.x() - cross * query_m.y(),
                                 cross * query_m.x() + dot * query_m.y());
  return (frame_m - turned_m / length).squaredNorm();
}

/// The mean of the hypotheses that agree with `seed`.
PlaceCluster cluster_around(const Hypothesis& seed, std::span<const Hypothesis> all) {
  PlaceCluster cluster{seed.frame, 0, {}};
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double turned = 0.0;
  for (const Hypothesis& one : all) {
    if (!same_place(seed, one)) continue;
    ++cluster.votes;
    sum += Eigen::Vector2d(one.x_m, one.y_m);
    turned += geometry::wrap_angle(one.heading_rad - seed.heading_rad);
  }
  const double n = cluster.votes;
  cluster.frame_T_query = {sum / n, seed.heading_rad + turned / n};
  return cluster;
}

}  // namespace

void TripletIndex::add(std::span<const LevelStem> stems, std::span<const StemTriangle> triangles) {
  const auto first = static_cast<constellation::Slot>(stems_.size());
  for (const LevelStem& stem : stems)
    stems_.push_back({stem.position_m.cast<float>(), log_of(stem.diameter_m), frames_});
  for (const StemTriangle& triangle : triangles) triangles_.add(indexed(triangle, first));
  ++frames_;
}

std::vector<Hypothesis> TripletIndex::hypotheses(std::span<const LevelStem> stems,
                                                 std::span<const StemTriangle> triangles,
                                                 const HypothesisFilter& filter) const {
  const auto tolerance = static_cast<float>(filter.side_tolerance_m);
  const auto log_tolerance = static_cast<float>(filter.diameter_log_tolerance);
  const double reach_m2 = filter.max_distance_m * filter.max_distance_m;
  std::vector<float> log_diameters;
  for (const LevelStem& stem : stems) log_diameters.push_back(log_of(stem.diameter_m));

  const auto frame_corners = [&](const constellation::TriangleIndex::Entry& entry) {
    Corners corners;
    for (std::size_t i = 0; i < 3; ++i)
      corners[i] = stems_[entry.vertex[i]].position_m.cast<double>();
    return corners;
  };

  std::vector<Hypothesis> found;
  for (const StemTriangle& triangle : triangles) {
    const Corners query{stems[triangle.corner[0]].position_m, stems[triangle.corner[1]].position_m,
                        stems[triangle.corner[2]].position_m};
    const auto consider = [&](const constellation::TriangleIndex::Entry& entry) {
      const std::uint32_t frame = stems_[entry.vertex[0]].frame;
      if (frame >= filter.end) return true;
      for (std::size_t i = 0; i < 3; ++i) {
        const float off = log_diameters[triangle.corner[i]] - stems_[entry.vertex[i]].log_diameter;
        // Unknown diameters agree with all: `off` is then NaN.
        if (std::abs(off) > log_tolerance) return true;
      }
      const Corners corners = frame_corners(entry);
      if (about_m2(corners, query) > kSurelyFarther * reach_m2) return true;
      const geometry::SE2 pose = geometry::align_rigid(corners, query);
      if (pose.translation().squaredNorm() <= reach_m2)
        found.push_back({frame, static_cast<float>(pose.x()), static_cast<float>(pose.y()),
                         static_cast<float>(pose.theta())});
      return true;
    };
    triangles_.for_each_similar(indexed(triangle, 0), {tolerance, tolerance, tolerance}, consider);
  }
  std::ranges::stable_sort(found, {}, &Hypothesis::frame);
  return found;
}

void collect_clusters(std::span<const Hypothesis> of_one_frame,
                      std::vector<PlaceCluster>& clusters) {
  const auto all = of_one_frame.first(std::min(of_one_frame.size(), kMostHypotheses));
  std::vector<std::pair<std::int64_t, std::uint32_t>> by_votes(all.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) {
    const std::int64_t votes = std::ranges::count_if(
        all, [&](const Hypothesis& other) { return same_place(all[i], other); });
    by_votes[i] = {-votes, i};
  }
  std::ranges::sort(by_votes);

  std::vector<std::uint32_t> taken;
  for (const auto& entry : by_votes) {
    const std::uint32_t i = entry.second;
    if (taken.size() == kClustersPerFrame) break;
    if (std::ranges::any_of(taken, [&](std::uint32_t k) { return same_place(all[k], all[i]); }))
      continue;
    taken.push_back(i);
    clusters.push_back(cluster_around(all[i], all));
  }
}

}  // namespace understory::place_recognition
