#include "sim/changes/changed_drive.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace understory::sim::changes {
namespace {

constexpr std::array<std::string_view, 5> kPointStateNames{"present", "gone", "moved", "new",
                                                           "newly_hidden"};

PointState state_of(ThingState state) {
  switch (state) {
    case ThingState::kPresent:
      return PointState::kPresent;
    case ThingState::kGone:
      return PointState::kGone;
    case ThingState::kMoved:
      return PointState::kMoved;
    case ThingState::kNew:
      return PointState::kNew;
  }
  return PointState::kPresent;
}

TruePoint truth_of(const SurfacePoint& point, PointState state) {
  TruePoint truth;
  truth.id = point.id;
  truth.state = state;
  truth.position_m = truth.before_m = point.position_m;
  truth.normal = point.normal;
  truth.descriptor = point.descriptor;
  return truth;
}

/// Positions of the points of both copies, without results of the drive.
std::vector<TruePoint> true_points(const Stage& before, const Stage& after,
                                   std::span<const TrueThing> things) {
  const auto thing_state = [&](PointId id) {
    const auto found =
        std::lower_bound(things.begin(), things.end(), thing_of(id),
                         [](const TrueThing& thing, ThingId x) { return thing.id < x; });
    return found->state;
  };
  std::vector<TruePoint> points;
  for (const SurfacePoint& point : before.points)
    points.push_back(truth_of(point, state_of(thing_state(point.id))));

  const std::size_t known = points.size();
  for (const SurfacePoint& point : after.points) {
    const ThingState state = thing_state(point.id);
    if (state == ThingState::kNew) points.push_back(truth_of(point, PointState::kNew));
    if (state != ThingState::kMoved) continue;
    const auto found = std::lower_bound(
        points.begin(), points.begin() + static_cast<std::ptrdiff_t>(known), point.id,
        [](const TruePoint& truth, PointId id) { return truth.id < id; });
    found->position_m = point.position_m;
  }
  std::sort(points.begin(), points.end(),
            [](const TruePoint& a, const TruePoint& b) { return a.id < b.id; });
  return points;
}

TruePoint* find_point(std::vector<TruePoint>& points, PointId id) {
  const auto found =
      std::lower_bound(points.begin(), points.end(), id,
                       [](const TruePoint& point, PointId x) { return point.id < x; });
  return found != points.end() && found->id == id ? &*found : nullptr;
}

/// Counts the sights of all points, and marks the newly hidden ones.
void count_sights(std::span<const CameraFrame> frames, std::vector<TruePoint>& points) {
  for (const CameraFrame& frame : frames) {
    for (const ExpectedPoint& expected : frame.expected) {
      TruePoint* const point = find_point(points, expected.point);
      if (point == nullptr) continue;
      point->frames_before += expected.was_visible ? 1 : 0;
      point->frames_visible +=
          expected.sight == Sight::kVisible || expected.sight == Sight::kNew ? 1 : 0;
      point->frames_hidden += expected.sight == Sight::kNewlyHidden ? 1 : 0;
    }
  }

  for (TruePoint& point : points) {
    const bool is_hidden = point.frames_hidden > 0 && point.frames_visible == 0;
    if (point.state == PointState::kPresent && is_hidden) point.state = PointState::kNewlyHidden;
  }
}

}  // namespace

std::string_view to_string(PointState state) {
  return kPointStateNames[static_cast<std::size_t>(state)];
}

const TruePoint* ChangedDrive::find(PointId id) const {
  const auto found =
      std::lower_bound(points.begin(), points.end(), id,
                       [](const TruePoint& point, PointId x) { return point.id < x; });
  return found != points.end() && found->id == id ? &*found : nullptr;
}

Replay::Replay(Course course, const Diff& diff, const TextureParameters& textures)
    : route_(std::move(course.route)), motion_(course.path.replay()) {
  unchanged_ = std::make_shared<const Stage>(course.scene, textures);
  copy_ = std::make_shared<const Stage>(changed(course.scene, diff), textures);
}

std::vector<Replay::Stop> Replay::stops(const CameraParameters& camera) const {
  std::vector<Stop> stops;
  const auto count = static_cast<int>(std::floor(motion_.duration_s() * camera.rate_hz)) + 1;
  for (int k = 0; k < count; ++k) {
    const double time_s = k / camera.rate_hz;
    stops.push_back({static_cast<model::Utime>(std::llround(1e6 * time_s)),
                     motion_.at(time_s).world_T_vehicle()});
  }
  return stops;
}

KeypointCamera Replay::look(const CameraParameters& camera, std::uint64_t seed) const {
  return {*unchanged_, *copy_, camera, seed};
}

ChangedDrive Replay::drive(const CameraParameters& camera, std::uint64_t seed,
                           const std::function<void(double)>& progress) const {
  ChangedDrive result;
  result.camera = camera;
  result.things = compare(unchanged_->scene, copy_->scene);
  result.points = true_points(*unchanged_, *copy_, result.things);

  KeypointCamera eyes = look(camera, seed);
  const std::vector<Stop> all = stops(camera);
  for (std::size_t k = 0; k < all.size(); ++k) {
    result.frames.push_back(eyes.frame(all[k].world_T_body, k, all[k].utime));
    if (progress) progress(static_cast<double>(k + 1) / static_cast<double>(all.size()));
  }
  count_sights(result.frames, result.points);
  return result;
}

SensorDrive Replay::sensors(SensorSuite suite, std::uint64_t seed) const {
  return {Scenario{copy_->built.world, route_}, motion_, std::move(suite), seed};
}

SensorSuite suite_for(SceneKind kind) {
  SensorSuite suite;
  suite.gnss.reset();
  if (kind == SceneKind::kForest) return suite;
  suite.wheels.reset();
  suite.imu->vehicle_T_sensor = Eigen::Isometry3d::Identity();
  suite.lidar->elevations_rad = beam_elevations_rad(LidarModel::kVlp16);
  suite.lidar->columns = 900;
  suite.lidar->max_range_m = 30.0;
  suite.lidar->min_range_m = 0.3;
  suite.lidar->vehicle_T_sensor = Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 0.1));
  return suite;
}

}  // namespace understory::sim::changes
