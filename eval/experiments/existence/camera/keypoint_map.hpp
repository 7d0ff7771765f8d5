// A map of points that a stereo camera makes of its own keypoints, with known poses.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "sim/changes/keypoint_camera.hpp"

namespace understory::eval::experiments::existence::camera {

/// A point of the map.
struct CameraPoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< Frame `world`.
  sim::changes::Descriptor descriptor{};                 ///< Each bit as most sightings had it.
  Eigen::Vector3d seen_from = Eigen::Vector3d::Zero();   ///< Sum of unit vectors to the camera.
  double nearest_m = 0.0;                                ///< Distance of the nearest sighting.
  double farthest_m = 0.0;                               ///< Of the farthest one.
  std::uint32_t sightings = 0;
  /// Truth, for scores alone: the point that most sightings were of; kNoPoint: a false one.
  sim::changes::PointId truth = sim::changes::kNoPoint;
};

/// Adds frames one after another; keypoints become points by stereo and are found again by
/// projection and descriptor, never by their true ids.
class MapBuilder {
 public:
  explicit MapBuilder(const sim::changes::CameraParameters& camera) : camera_(camera) {}

  /// `frame` was taken from `frame.world_T_camera`: the mapping drive's poses are known.
  void add(const sim::changes::CameraFrame& frame);
  /// The points with enough sightings, each texture once per place.
  std::vector<CameraPoint> finish() const;

 private:
  /// A keypoint as it was measured.
  struct Sighting {
    Eigen::Isometry3d camera_T_world;
    Eigen::Vector3d measured;  ///< Pixel and disparity [px].
  };
  /// What is kept of a point while the map grows.
  struct Track {
    std::vector<Sighting> sightings;
    std::array<std::uint16_t, 256> bits_set{};
    std::vector<sim::changes::PointId> ids;
  };

  void see(std::size_t point, const sim::changes::CameraFrame& frame,
           const sim::changes::Keypoint& keypoint);
  void improve(std::size_t point);

  sim::changes::CameraParameters camera_;
  std::vector<CameraPoint> points_;
  std::vector<Track> tracks_;
};

}  // namespace understory::eval::experiments::existence::camera
