// A stereo camera that gives keypoints instead of images.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "common/model/landmarks.hpp"
#include "sim/changes/surface_points.hpp"
#include "sim/ray_caster.hpp"

namespace understory::sim::changes {

/// A rectified pair of pinhole cameras with its detector. Frame `camera`: x to the right, y down, z
/// ahead, origin in the left one; the right one is `baseline_m` along x.
struct CameraParameters {
  int width_px = 640;
  int height_px = 480;
  double focal_px = 400.0;  ///< The principal point is in the middle of the image.
  double baseline_m = 0.12;
  double rate_hz = 5.0;
  double near_m = 0.4;            ///< Along z.
  double far_m = 12.0;            ///< Along z; farther points are too small for the detector.
  double most_oblique_rad = 1.2;  ///< Between normal and line of sight.

  double recall = 0.9;  ///< Share of the visible points that a frame detects.
  double recall_loss_far =
      0.0;  ///< Share of `recall` that is lost at far_m (linear in the distance).
  double false_per_frame = 5.0;    ///< Mean number of keypoints without a point.
  double pixel_sigma = 0.6;        ///< Per axis [px].
  double disparity_sigma = 0.6;    ///< [px]
  double flip_rate = 0.06;         ///< Share of a descriptor's bits that are wrong, seen frontally.
  double flip_rate_oblique = 0.1;  ///< Added at most_oblique_rad (linear in 1 - cosine).

  Eigen::Isometry3d body_T_camera = looking_ahead({0.0, 0.0, 0.0});

  /// Pose of a camera at `position_m` in the body's frame that looks along its x axis.
  static Eigen::Isometry3d looking_ahead(const Eigen::Vector3d& position_m);
  /// Pixel of a point in `camera`, which must be in front of it.
  Eigen::Vector2d project(const Eigen::Vector3d& camera_point_m) const;
  /// Direction of a pixel, with z = 1.
  Eigen::Vector3d ray_of(const Eigen::Vector2d& pixel) const;
  /// Point in `camera` of a pixel with a disparity > 0.
  Eigen::Vector3d triangulate(const Eigen::Vector2d& pixel, double disparity_px) const;
  /// Whether a point in `camera` is in the frustum: within the left image, between near and far.
  bool sees(const Eigen::Vector3d& camera_point_m) const;
};
/// Suitable camera for a scene: in a forest on the roof of the car with a far limit of 25 m.
CameraParameters camera_for(SceneKind kind);

/// Output of the detector. The last two fields are truth: a segmentation camera would give `thing`;
/// no sensor gives `point`.
struct Keypoint {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double disparity_px = 0.0;
  Descriptor descriptor{};
  ThingId thing = kGroundThing;
  PointId point = kNoPoint;
};

/// Visibility of a point in the frustum.
enum class Sight : std::uint8_t {
  kVisible,      ///< At its place, unobstructed.
  kHidden,       ///< At its place, obstructed in the unchanged scene, too.
  kNewlyHidden,  ///< At its place, unobstructed in the unchanged scene, obstructed now.
  kGone,         ///< No longer there.
  kNew,          ///< Not in the unchanged scene; visible.
};

/// "visible", "hidden", "newly_hidden", "gone", "new".
std::string_view to_string(Sight sight);

/// Truth of one point for one frame. A moved point may be listed twice: kGone at the old place and
/// kNew at the present one.
struct ExpectedPoint {
  PointId point = kNoPoint;
  Sight sight = Sight::kVisible;
  bool was_visible = false;         ///< In the unchanged scene, from the same pose.
  bool is_detected = false;         ///< It gave a keypoint of this frame.
  ThingId occluder = kGroundThing;  ///< The object in front, if it is hidden.
  float range_m = 0.0F;             ///< From the camera to the point's place, or its former one.
  float measured_m =
      0.0F;  ///< Range of the first surface on the line of sight; 0: none within range.
};

/// One frame.
struct CameraFrame {
  model::Utime utime = 0;
  std::uint64_t number = 0;
  Eigen::Isometry3d world_T_camera = Eigen::Isometry3d::Identity();  ///< True.
  std::vector<Keypoint> keypoints;
  /// Points of the unchanged scene in the frustum and not too oblique, then new visible ones.
  std::vector<ExpectedPoint> expected;
};

/// A scene prepared for the camera, with the built world and its points.
struct Stage {
  Scene scene;
  BuiltScene built;
  std::vector<SurfacePoint> points;

  /// Builds it.
  explicit Stage(Scene scene_in, const TextureParameters& textures = {})
      : scene(std::move(scene_in)),
        built(build(scene)),
        points(surface_points(scene, built, textures)) {}
};

/// Views a copy of a scene and compares it with the unchanged one. Frame k does not depend on
/// earlier calls. One camera per thread.
class KeypointCamera {
 public:
  /// Both stages must outlive the camera; they may be the same one.
  KeypointCamera(const Stage& unchanged, const Stage& copy, const CameraParameters& parameters,
                 std::uint64_t seed);

  /// The frame `number` from this pose of the body. Cost: two rays for each point in the frustum.
  CameraFrame frame(const Eigen::Isometry3d& world_T_body, std::uint64_t number,
                    model::Utime utime);
  /// The parameters of the constructor.
  const CameraParameters& parameters() const { return parameters_; }

 private:
  struct Look;
  void add_known(const Look& look, CameraFrame& frame);
  void add_new(const Look& look, CameraFrame& frame);
  void add_false(const Look& look, CameraFrame& frame) const;
  bool detect(const Look& look, const SurfacePoint& point, CameraFrame& frame) const;
  bool is_in_view(const Look& look, const SurfacePoint& point) const;

  const Stage& unchanged_;
  const Stage& copy_;
  CameraParameters parameters_;
  std::uint64_t seed_;
  RayCaster caster_before_;
  RayCaster caster_;
  std::unordered_map<PointId, std::size_t> now_;  ///< Index in copy_.points.
  std::vector<std::size_t> new_points_;  ///< Indices in copy_.points: new, or at another place.
};

}  // namespace understory::sim::changes
