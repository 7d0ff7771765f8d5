#include "services/viewer/known_truth.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace understory::viewer {
namespace {

constexpr double kTruthEvery_m = 0.2;
constexpr double kRedraw_m = 0.05;

TrackPoint point_in_map(const geometry::SE2& world_T_map, model::Utime utime,
                        const geometry::SE2& world_T_vehicle) {
  const geometry::SE2 at = world_T_map.inverse() * world_T_vehicle;
  return {utime,
          static_cast<float>(at.x()),
          static_cast<float>(at.y()),
          static_cast<float>(at.theta()),
          0.0F,
          0};
}

}  // namespace

void KnownTruth::take(model::Utime utime, const geometry::SE2& world_T_vehicle) {
  // The newest truth is kept in full, since poses are compared with it; older truth is thinned.
  const std::size_t size = world_truth_.size();
  if (size > 1 &&
      (world_truth_[size - 2].second.translation() - world_T_vehicle.translation()).norm() <
          kTruthEvery_m) {
    world_truth_.back() = {utime, world_T_vehicle};
    return;
  }
  if (size >= Track::kMostPoints)
    world_truth_.erase(world_truth_.begin(), world_truth_.begin() + Track::kMostPoints / 2);
  world_truth_.emplace_back(utime, world_T_vehicle);
}

/// Interpolates between two neighbouring ones; none outside the time received.
std::optional<geometry::SE2> KnownTruth::at(model::Utime utime) const {
  const auto after = std::ranges::lower_bound(world_truth_, utime, {},
                                              &std::pair<model::Utime, geometry::SE2>::first);
  if (after == world_truth_.end()) return std::nullopt;
  if (after->first == utime) return after->second;
  if (after == world_truth_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double part = static_cast<double>(utime - before->first) /
                      static_cast<double>(after->first - before->first);
  return before->second *
         geometry::SE2::Exp(part * (before->second.inverse() * after->second).Log());
}

void KnownTruth::start_map() {
  track_.clear();
  pose_.changed(*changes_).reset();
  alignment_.clear();
  world_T_map_.reset();
}

void KnownTruth::tie(const model::MapUpdate& first) {
  const auto world_T_vehicle = at(first.utime);
  world_T_map_.reset();
  if (world_T_vehicle) world_T_map_ = *world_T_vehicle * first.map_T_vehicle.inverse();
}

std::optional<TruthError> KnownTruth::compare(const model::SlamPose& pose) {
  const auto world_T_vehicle = at(pose.utime);
  if (!world_T_vehicle) return std::nullopt;
  const geometry::SE2 map_T_vehicle = pose.map_T_vehicle();
  if (pose.is_localised())
    alignment_.add(map_T_vehicle.translation(), world_T_vehicle->translation());
  const auto world_T_map = world_T_map_ ? world_T_map_ : alignment_.world_T_map();
  if (!world_T_map) return std::nullopt;

  const geometry::SE2 map_T_truth = world_T_map->inverse() * *world_T_vehicle;
  pose_.changed(*changes_) = map_T_truth;
  draw(*world_T_map, map_T_vehicle);

  const Eigen::Vector3d error = (map_T_vehicle.inverse() * map_T_truth).Log();
  TruthError result{error.head<2>().norm(), std::abs(error.z()), std::nullopt,
                    world_T_map_.has_value()};
  const Eigen::LLT<Eigen::Matrix3d> factor(pose.covariance);
  if (factor.info() == Eigen::Success) result.nees = error.dot(factor.solve(error));
  return result;
}

/// Draws the path so far again if the alignment has moved it visibly.
void KnownTruth::draw(const geometry::SE2& world_T_map, const geometry::SE2& map_T_vehicle) {
  const geometry::SE2 shift = drawn_world_T_map_.inverse() * world_T_map;
  const double reach_m = map_T_vehicle.translation().norm();
  const bool is_off = shift.translation().norm() + std::abs(shift.theta()) * reach_m > kRedraw_m;

  if (is_off || track_.points().empty()) {
    draw_whole(world_T_map);
  } else if (world_truth_.back().first > track_.points().back().utime) {
    draw_newest(world_T_map);
  }
}

void KnownTruth::draw_whole(const geometry::SE2& world_T_map) {
  drawn_world_T_map_ = world_T_map;
  std::vector<TrackPoint> points;
  points.reserve(world_truth_.size());
  for (const auto& [utime, world_T_vehicle] : world_truth_)
    points.push_back(point_in_map(world_T_map, utime, world_T_vehicle));
  track_.replace_from(0, points);
}

/// In the place of the last point where that is near to the one before it.
void KnownTruth::draw_newest(const geometry::SE2& world_T_map) {
  const auto& [utime, world_T_vehicle] = world_truth_.back();
  const TrackPoint newest = point_in_map(world_T_map, utime, world_T_vehicle);
  const auto points = track_.points();
  const bool is_near =
      points.size() > 1 && std::hypot(points[points.size() - 2].x_m - newest.x_m,
                                      points[points.size() - 2].y_m - newest.y_m) < kTruthEvery_m;
  if (is_near) {
    track_.replace_last(newest);
  } else {
    track_.append(newest);
  }
}

}  // namespace understory::viewer
