// Frames in space for detectors and verifiers: a random forest of stems with height, as landmarks
// and as clouds.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/place_recognition/place_frame.hpp"

namespace understory::test {

/// Landmarks uniform in a disc, heights of a metre or so.
inline place_recognition::PlaceFrame random_frame(std::mt19937_64& random, std::size_t landmarks,
                                                  double radius_m = 25.0) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> height(0.0, 1.0);
  place_recognition::PlaceFrame frame;
  for (std::size_t i = 0; i < landmarks; ++i) {
    const double range = radius_m * std::sqrt(unit(random));
    const double angle = 2.0 * std::numbers::pi * unit(random);
    const double z = height(random);
    frame.landmarks.push_back(
        {{range * std::cos(angle), range * std::sin(angle), z}, 0.2 + 0.3 * unit(random)});
  }
  return frame;
}

/// The frame as it looks from `frame_T_query`.
inline place_recognition::PlaceFrame seen_from(const place_recognition::PlaceFrame& frame,
                                               const geometry::SE2& frame_T_query) {
  const geometry::SE2 query_T_frame = frame_T_query.inverse();
  place_recognition::PlaceFrame seen = frame;
  for (place_recognition::PlaceLandmark& landmark : seen.landmarks)
    landmark.position_m.head<2>() = query_T_frame * Eigen::Vector2d(landmark.position_m.head<2>());
  for (Eigen::Vector3f& point : seen.cloud) {
    const Eigen::Vector2d at = query_T_frame * Eigen::Vector2d(point.head<2>().cast<double>());
    point.head<2>() = at.cast<float>();
  }
  return seen;
}

/// Noise on every landmark, in the plane.
inline void disturb(place_recognition::PlaceFrame& frame, double sigma_m, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0.0, sigma_m);
  for (place_recognition::PlaceLandmark& landmark : frame.landmarks) {
    const double x = noise(random);
    const double y = noise(random);
    landmark.position_m += Eigen::Vector3d(x, y, 0.0);
  }
}

/// Points on stems (vertical lines of radius 0.2 m), on a wall and on the ground; drawn anew at
/// each call, with noise.
inline std::vector<Eigen::Vector3f> random_cloud(const place_recognition::PlaceFrame& frame,
                                                 double sigma_m, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, sigma_m);
  std::vector<Eigen::Vector3f> points;
  const auto add = [&](double x, double y, double z) {
    const double dx = noise(random);
    const double dy = noise(random);
    const double dz = noise(random);
    points.emplace_back(Eigen::Vector3d(x + dx, y + dy, z + dz).cast<float>());
  };
  for (const place_recognition::PlaceLandmark& landmark : frame.landmarks) {
    for (int k = 0; k < 30; ++k) {
      const double angle = 2.0 * std::numbers::pi * unit(random);
      add(landmark.position_m.x() + 0.2 * std::cos(angle),
          landmark.position_m.y() + 0.2 * std::sin(angle), 2.0 * unit(random));
    }
  }
  for (int k = 0; k < 250; ++k) add(20.0 * unit(random) - 10.0, 12.0, 3.0 * unit(random));
  for (int k = 0; k < 250; ++k) add(-14.0, 20.0 * unit(random) - 10.0, 3.0 * unit(random));
  for (int k = 0; k < 400; ++k) add(30.0 * unit(random) - 15.0, 30.0 * unit(random) - 15.0, -1.5);
  return points;
}

/// A motion of some metres and any heading.
inline geometry::SE2 random_motion(std::mt19937_64& random, double reach_m, double turn_rad) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double x = reach_m * unit(random);
  const double y = reach_m * unit(random);
  return {x, y, turn_rad * unit(random)};
}

}  // namespace understory::test
