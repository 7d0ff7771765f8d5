#include "eval/experiments/existence/observer.hpp"

#include <bit>
#include <cmath>
#include <numbers>

namespace understory::eval::experiments::existence {
namespace {

using understory::existence::Ray;

constexpr int kScoredLooks = 10;
constexpr int kScoredDirections = 3;

float cross2(const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// One of eight directions, as a bit.
std::uint32_t direction_bit(const Eigen::Vector3f& from_point_m) {
  const double turn = std::atan2(from_point_m.y(), from_point_m.x()) / std::numbers::pi + 1.0;
  return 1U << (static_cast<unsigned>(turn * 4.0) % 8U);
}

}  // namespace

bool crosses(const Segment& segment, const Eigen::Vector2f& from_m, const Eigen::Vector2f& to_m,
             float& at) {
  const Eigen::Vector2f way = to_m - from_m;
  const Eigen::Vector2f side = segment.b_m - segment.a_m;
  const float determinant = cross2(way, side);
  if (std::abs(determinant) < 1e-9F) return false;
  const Eigen::Vector2f start = segment.a_m - from_m;
  at = cross2(start, side) / determinant;
  const float along = cross2(start, way) / determinant;
  return at > 0.0F && at < 1.0F && along >= 0.0F && along <= 1.0F;
}

LookEvent Observer::look(std::uint32_t point, const Eigen::Vector3f& place_m,
                         const std::vector<Segment>& occluders, bool can_be_seen, bool exists) {
  LookEvent event;
  event.point = point;
  event.look.from_point_m = place_m - points_m_[point];
  event.is_clear = true;
  const Eigen::Vector2f from_m = place_m.head<2>();
  const Eigen::Vector2f to_m = points_m_[point].head<2>();
  for (const Segment& segment : occluders) {
    float at = 1.0F;
    if (crosses(segment, from_m, to_m, at)) event.is_clear = false;
  }

  const double share = event.look.from_point_m.norm() / setting_.range_m;
  event.recall = setting_.recall_near + share * (setting_.recall_far - setting_.recall_near);
  const bool is_false = unit() < setting_.false_rate;
  const bool is_detected = unit() < event.recall;
  event.is_seen = is_false || (exists && can_be_seen && event.is_clear && is_detected);
  if (setting_.has_ranges && !event.is_seen) {
    if (!event.is_clear) event.look.ray = Ray::kBlocked;
    // What is there returns the ray, detected or not; a ray beside a thin stem passes it.
    if (event.is_clear && !exists) event.look.ray = Ray::kPassed;
  }
  return event;
}

DriveLooks Observer::drive(double time_s, const std::vector<Eigen::Vector3f>& places_m,
                           const std::vector<Segment>& occluders, const std::vector<bool>& exists) {
  DriveLooks drive;
  drive.time_s = time_s;
  const std::size_t count = points_m_.size();
  std::vector<bool> can_be_seen(count);
  for (std::size_t i = 0; i < count; ++i) can_be_seen[i] = unit() >= setting_.pass_missed;
  std::vector<int> clear(count, 0), looked(count, 0);
  std::vector<std::uint32_t> directions(count, 0);

  for (const Eigen::Vector3f& place_m : places_m) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const double distance_m = (points_m_[i] - place_m).norm();
      if (distance_m >= setting_.range_m || distance_m < 0.5) continue;
      drive.looks.push_back(look(i, place_m, occluders, can_be_seen[i], exists[i]));
      ++looked[i];
      if (!drive.looks.back().is_clear) continue;
      ++clear[i];
      directions[i] |= direction_bit(drive.looks.back().look.from_point_m);
    }
  }

  for (std::size_t i = 0; i < count; ++i) {
    const bool is_scored =
        clear[i] >= kScoredLooks && std::popcount(directions[i]) >= kScoredDirections;
    drive.truth.push_back({exists[i], is_scored, exists[i] && looked[i] > 0 && clear[i] == 0});
  }
  return drive;
}

}  // namespace understory::eval::experiments::existence
