#include "sim/changes/keypoint_camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>

#include "sim/hash_random.hpp"

namespace understory::sim::changes {
namespace {

constexpr std::array<std::string_view, 5> kSightNames{"visible", "hidden", "newly_hidden", "gone",
                                                      "new"};
/// A surface this much nearer than the point is in front of it [m].
constexpr double kInFront = 0.01;
/// Rays are cast this far beyond the point, to find what is there instead [m].
constexpr double kBeyond = 30.0;

/// Independent random numbers for one point in one frame.
enum PointChance : std::uint64_t { kRecall = 1, kPixelU, kPixelV, kDisparity, kBits, kLeaves };

struct FirstSurface {
  double range_m = 0.0;  ///< 0: none within reach.
  ThingId thing = kGroundThing;
  bool is_in_front = false;
};

/// The first surface on the line of sight to a point.
FirstSurface first_surface(RayCaster& caster, const BuiltScene& built,
                           const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m,
                           std::uint64_t luck) {
  const double distance = (to_m - from_m).norm();
  const Eigen::Vector3d direction = (to_m - from_m) / distance;
  RayHit hit;
  caster.cast(from_m, std::span(&direction, 1), 0.0, distance + kBeyond, luck, std::span(&hit, 1));
  if (!hit.is_hit) return {};
  return {hit.range_m, built.thing_of(hit.object), hit.range_m < distance - kInFront};
}

/// Quantisation of a detector's positions.
double in_steps(double px) {
  constexpr double kPerPixel = 64.0;
  return std::round(kPerPixel * px) / kPerPixel;
}
Eigen::Vector2d in_steps(const Eigen::Vector2d& px) { return {in_steps(px.x()), in_steps(px.y())}; }

/// Flips each bit with probability `rate`.
Descriptor with_noise(Descriptor descriptor, double rate, std::uint64_t key) {
  for (std::size_t word = 0; word < descriptor.size(); ++word) {
    for (std::uint64_t bit = 0; bit < 64; ++bit) {
      const bool is_flipped = uniform_of(mixed(key + 64 * word + bit)) < rate;
      if (is_flipped) descriptor[word] ^= std::uint64_t{1} << bit;
    }
  }
  return descriptor;
}

}  // namespace

std::string_view to_string(Sight sight) { return kSightNames[static_cast<std::size_t>(sight)]; }

Eigen::Isometry3d CameraParameters::looking_ahead(const Eigen::Vector3d& position_m) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = -Eigen::Vector3d::UnitY();
  pose.linear().col(1) = -Eigen::Vector3d::UnitZ();
  pose.linear().col(2) = Eigen::Vector3d::UnitX();
  pose.translation() = position_m;
  return pose;
}

Eigen::Vector2d CameraParameters::project(const Eigen::Vector3d& camera_point_m) const {
  return focal_px * camera_point_m.head<2>() / camera_point_m.z() +
         0.5 * Eigen::Vector2d(width_px, height_px);
}

Eigen::Vector3d CameraParameters::ray_of(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d at = (pixel - 0.5 * Eigen::Vector2d(width_px, height_px)) / focal_px;
  return {at.x(), at.y(), 1.0};
}

Eigen::Vector3d CameraParameters::triangulate(const Eigen::Vector2d& pixel,
                                              double disparity_px) const {
  return focal_px * baseline_m / disparity_px * ray_of(pixel);
}

bool CameraParameters::sees(const Eigen::Vector3d& camera_point_m) const {
  if (camera_point_m.z() < near_m || camera_point_m.z() > far_m) return false;
  const Eigen::Vector2d pixel = project(camera_point_m);
  return pixel.x() >= 0.0 && pixel.x() < width_px && pixel.y() >= 0.0 && pixel.y() < height_px;
}

CameraParameters camera_for(SceneKind kind) {
  CameraParameters camera;
  if (kind != SceneKind::kForest) return camera;
  camera.far_m = 25.0;
  camera.baseline_m = 0.3;
  camera.body_T_camera = CameraParameters::looking_ahead({1.6, 0.0, 1.5});
  return camera;
}

/// A camera at its pose.
struct KeypointCamera::Look {
  Eigen::Isometry3d world_T_camera;
  Eigen::Isometry3d camera_T_world;
  std::uint64_t key = 0;

  Eigen::Vector3d eye_m() const { return world_T_camera.translation(); }
  std::uint64_t chance(PointId point, PointChance use) const {
    return mixed(mixed(key, point), use);
  }
};

KeypointCamera::KeypointCamera(const Stage& unchanged, const Stage& copy,
                               const CameraParameters& parameters, std::uint64_t seed)
    : unchanged_(unchanged),
      copy_(copy),
      parameters_(parameters),
      seed_(mixed(seed, 0xca3e7a)),
      caster_before_(*unchanged.built.world, 2.0),
      caster_(*copy.built.world, 2.0) {
  std::unordered_map<PointId, std::size_t> before;
  for (std::size_t i = 0; i < unchanged.points.size(); ++i) before[unchanged.points[i].id] = i;
  for (std::size_t i = 0; i < copy.points.size(); ++i) {
    const SurfacePoint& point = copy.points[i];
    now_[point.id] = i;
    const auto was = before.find(point.id);
    const bool is_where_it_was =
        was != before.end() && unchanged.points[was->second].position_m == point.position_m;
    if (!is_where_it_was) new_points_.push_back(i);
  }
}

bool KeypointCamera::is_in_view(const Look& look, const SurfacePoint& point) const {
  if (!parameters_.sees(look.camera_T_world * point.position_m)) return false;
  const Eigen::Vector3d to_eye = (look.eye_m() - point.position_m).normalized();
  return point.normal.dot(to_eye) > std::cos(parameters_.most_oblique_rad);
}

bool KeypointCamera::detect(const Look& look, const SurfacePoint& point, CameraFrame& frame) const {
  const CameraParameters& p = parameters_;
  const Eigen::Vector3d at = look.camera_T_world * point.position_m;
  const double recall = p.recall - p.recall_loss_far * at.z() / p.far_m;
  if (uniform_of(look.chance(point.id, kRecall)) >= recall) return false;

  Keypoint keypoint;
  const Eigen::Vector2d noise(normal_of(look.chance(point.id, kPixelU)),
                              normal_of(look.chance(point.id, kPixelV)));
  keypoint.pixel = in_steps(p.project(at) + p.pixel_sigma * noise);
  keypoint.disparity_px =
      in_steps(p.focal_px * p.baseline_m / at.z() +
               p.disparity_sigma * normal_of(look.chance(point.id, kDisparity)));
  const double cosine = point.normal.dot((look.eye_m() - point.position_m).normalized());
  const double obliqueness = (1.0 - cosine) / (1.0 - std::cos(p.most_oblique_rad));
  keypoint.descriptor =
      with_noise(point.descriptor, p.flip_rate + p.flip_rate_oblique * obliqueness,
                 look.chance(point.id, kBits));

  keypoint.thing = thing_of(point.id);
  keypoint.point = point.id;
  frame.keypoints.push_back(keypoint);
  return true;
}

/// The points of the unchanged scene, in any state.
void KeypointCamera::add_known(const Look& look, CameraFrame& frame) {
  for (const SurfacePoint& point : unchanged_.points) {
    if (!is_in_view(look, point)) continue;
    const std::uint64_t luck = look.chance(point.id, kLeaves);
    const auto before =
        first_surface(caster_before_, unchanged_.built, look.eye_m(), point.position_m, luck);
    const auto now = first_surface(caster_, copy_.built, look.eye_m(), point.position_m, luck);

    ExpectedPoint expected;
    expected.point = point.id;
    expected.was_visible = !before.is_in_front;
    expected.range_m = static_cast<float>((point.position_m - look.eye_m()).norm());
    expected.measured_m = static_cast<float>(now.range_m);
    const auto found = now_.find(point.id);
    const bool is_there =
        found != now_.end() && copy_.points[found->second].position_m == point.position_m;

    if (now.is_in_front) expected.occluder = now.thing;
    if (!is_there) {
      expected.sight = Sight::kGone;
    } else if (now.is_in_front) {
      expected.sight = before.is_in_front ? Sight::kHidden : Sight::kNewlyHidden;
    } else {
      expected.sight = Sight::kVisible;
      expected.is_detected = detect(look, point, frame);
    }
    frame.expected.push_back(expected);
  }
}

/// New points, and points at a new place.
void KeypointCamera::add_new(const Look& look, CameraFrame& frame) {
  for (const std::size_t i : new_points_) {
    const SurfacePoint& point = copy_.points[i];
    if (!is_in_view(look, point)) continue;
    const auto now = first_surface(caster_, copy_.built, look.eye_m(), point.position_m,
                                   look.chance(point.id, kLeaves));
    if (now.is_in_front) continue;
    ExpectedPoint expected;
    expected.point = point.id;
    expected.sight = Sight::kNew;
    expected.range_m = static_cast<float>((point.position_m - look.eye_m()).norm());
    expected.measured_m = static_cast<float>(now.range_m);
    expected.is_detected = detect(look, point, frame);
    frame.expected.push_back(expected);
  }
}

void KeypointCamera::add_false(const Look& look, CameraFrame& frame) const {
  const CameraParameters& p = parameters_;
  if (p.false_per_frame <= 0.0) return;
  std::mt19937_64 random(mixed(look.key, 0xfa15e));
  const int count = std::poisson_distribution<int>(p.false_per_frame)(random);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int i = 0; i < count; ++i) {
    Keypoint keypoint;
    keypoint.pixel.x() = in_steps(p.width_px * share(random));
    keypoint.pixel.y() = in_steps(p.height_px * share(random));
    const double depth_m = p.near_m + (p.far_m - p.near_m) * share(random);
    keypoint.disparity_px = in_steps(p.focal_px * p.baseline_m / depth_m);
    for (std::uint64_t& word : keypoint.descriptor) word = random();
    frame.keypoints.push_back(keypoint);
  }
}

CameraFrame KeypointCamera::frame(const Eigen::Isometry3d& world_T_body, std::uint64_t number,
                                  model::Utime utime) {
  Look look;
  look.world_T_camera = world_T_body * parameters_.body_T_camera;
  look.camera_T_world = look.world_T_camera.inverse();
  look.key = mixed(seed_, number);

  CameraFrame frame;
  frame.utime = utime;
  frame.number = number;
  frame.world_T_camera = look.world_T_camera;
  add_known(look, frame);
  add_new(look, frame);
  add_false(look, frame);
  return frame;
}

}  // namespace understory::sim::changes
