// Small courses and drives for the tests of changed worlds.
#pragma once

#include "sim/changes/changed_drive.hpp"

namespace understory::test {

inline sim::changes::Course course_of(sim::changes::SceneKind kind, std::uint64_t seed = 1) {
  sim::changes::CourseParameters parameters;
  parameters.standstill_s = 1.0;
  parameters.length_m = 60.0;
  parameters.margin_m = 25.0;
  return sim::changes::make_course(kind, parameters, seed);
}

/// A quick camera: a frame every two seconds.
inline sim::changes::CameraParameters slow_camera(sim::changes::SceneKind kind) {
  sim::changes::CameraParameters camera = sim::changes::camera_for(kind);
  camera.rate_hz = 0.5;
  return camera;
}

inline constexpr sim::changes::SceneKind kAllScenes[] = {sim::changes::SceneKind::kForest,
                                                         sim::changes::SceneKind::kOffice,
                                                         sim::changes::SceneKind::kStation};

}  // namespace understory::test
