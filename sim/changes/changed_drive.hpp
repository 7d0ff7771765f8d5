// The same path through an unchanged and a changed copy of a scene, with ground truth.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "sim/changes/diff.hpp"
#include "sim/changes/keypoint_camera.hpp"
#include "sim/sensor_drive.hpp"

namespace understory::sim::changes {

/// State of a point over the whole drive.
enum class PointState : std::uint8_t {
  kPresent,      ///< At its place.
  kGone,         ///< Its thing was removed.
  kMoved,        ///< Its thing was moved: gone at the old place, new at the present one.
  kNew,          ///< Its thing was added.
  kNewlyHidden,  ///< At its place; visible in the unchanged scene from a part of the path, never in
                 ///< the copy.
};
/// "present", "gone", "moved", "new", "newly_hidden".
std::string_view to_string(PointState state);

/// Truth of a point.
struct TruePoint {
  PointId id = kNoPoint;
  PointState state = PointState::kPresent;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< In the copy; if gone, the earlier one.
  Eigen::Vector3d before_m =
      Eigen::Vector3d::Zero();  ///< In the unchanged scene; if new, as above.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();
  Descriptor descriptor{};          ///< Without noise.
  std::uint32_t frames_before = 0;  ///< Frames in which it was visible in the unchanged scene.
  std::uint32_t frames_visible =
      0;  ///< Frames in which it is visible in the copy, at its present place.
  std::uint32_t frames_hidden = 0;  ///< Frames in which it is newly hidden.
};

/// Camera data and truth of one replay of the path. LIDAR and inertial data are too large to be
/// stored: see sensors().
struct ChangedDrive {
  CameraParameters camera;
  std::vector<CameraFrame> frames;
  std::vector<TrueThing> things;  ///< Of both copies, in order of id.
  std::vector<TruePoint> points;  ///< Of both copies, in order of id.

  /// The point with this id; null if there is none. O(log n).
  const TruePoint* find(PointId id) const;
};

/// A course and one changed copy of it. The same arguments give the same drives.
class Replay {
 public:
  /// An empty diff replays the unchanged copy.
  Replay(Course course, const Diff& diff, const TextureParameters& textures = {});

  /// Poses of the camera's frames along the path, without images: utime and world_T_body.
  struct Stop {
    model::Utime utime = 0;
    Eigen::Isometry3d world_T_body = Eigen::Isometry3d::Identity();
  };
  std::vector<Stop> stops(const CameraParameters& camera) const;
  /// A camera in the copy, for drives too long to be stored frame by frame. The replay must outlive
  /// it.
  KeypointCamera look(const CameraParameters& camera, std::uint64_t seed) const;
  /// Replays the path with the camera. `progress` gets a share in [0, 1] and may throw.
  ChangedDrive drive(const CameraParameters& camera, std::uint64_t seed,
                     const std::function<void(double)>& progress = {}) const;
  /// LIDAR, inertial unit and true poses along the same path through the copy.
  SensorDrive sensors(SensorSuite suite, std::uint64_t seed) const;

  /// The unchanged copy.
  const Stage& unchanged() const { return *unchanged_; }
  /// The changed copy.
  const Stage& copy() const { return *copy_; }
  /// The motion of the body.
  const VehicleMotion& motion() const { return motion_; }

 private:
  Route route_;
  VehicleMotion motion_;
  std::shared_ptr<const Stage> unchanged_;
  std::shared_ptr<const Stage> copy_;
};

/// Suitable sensors for a scene: an inertial unit and a LIDAR of 16 beams; in a forest wheels and
/// 32 beams; no GNSS.
SensorSuite suite_for(SceneKind kind);

}  // namespace understory::sim::changes
