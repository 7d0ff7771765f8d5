// A camera found again in a map of keypoints, of an unchanged and of a changed office.
#include "eval/harness/camera_relocalisation.hpp"
#include "sim/changes/changed_drive.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::harness;
using namespace understory::sim::changes;

namespace {

struct Rate {
  int frames = 0;
  int found = 0;
  int wrong = 0;  ///< Poses outside of the limits.
  int iterations = 0;
};

Rate relocalise_all(const ChangedDrive& drive, const std::vector<MappedKeypoint>& map) {
  Rate rate;
  for (const CameraFrame& frame : drive.frames) {
    const Relocalisation result = relocalise(frame, drive.camera, map, {}, frame.number);
    ++rate.frames;
    rate.found += result.is_success ? 1 : 0;
    rate.wrong += result.is_accepted && !result.is_success ? 1 : 0;
    rate.iterations += result.pose.iterations;
  }
  return rate;
}

std::vector<MappedKeypoint> map_of(const Stage& stage, const ChangedDrive* only_present) {
  std::vector<MappedKeypoint> map;
  for (const SurfacePoint& point : stage.points) {
    if (only_present != nullptr) {
      const PointState state = only_present->find(point.id)->state;
      if (state == PointState::kGone || state == PointState::kMoved) continue;
    }
    map.push_back({point.position_m, point.descriptor});
  }
  return map;
}

}  // namespace

TEST_CASE("every frame is found in the map of the unchanged world") {
  const Course course = make_course(SceneKind::kOffice, {}, 1);
  const Replay replay(course, {});
  CameraParameters camera = camera_for(SceneKind::kOffice);
  camera.rate_hz = 0.5;
  const ChangedDrive drive = replay.drive(camera, 2);
  const Rate rate = relocalise_all(drive, map_of(replay.unchanged(), nullptr));
  CHECK(rate.frames > 20);
  CHECK(rate.found == rate.frames);
  CHECK(rate.wrong == 0);
}

TEST_CASE("an old map costs samples; without what is gone it costs fewer") {
  const Course course = make_course(SceneKind::kOffice, {}, 1);
  DiffParameters parameters;
  parameters.share = 0.5;
  parameters.moved_share = 0.8;
  const Replay replay(course, make_diff(course, parameters, 4));
  CameraParameters camera = camera_for(SceneKind::kOffice);
  camera.rate_hz = 0.5;
  const ChangedDrive drive = replay.drive(camera, 2);
  const Rate old = relocalise_all(drive, map_of(replay.unchanged(), nullptr));
  const Rate ideal = relocalise_all(drive, map_of(replay.unchanged(), &drive));
  CAPTURE(old.found, ideal.found, old.iterations, ideal.iterations);
  CHECK(ideal.iterations < old.iterations);
  CHECK(ideal.found >= old.found);
  CHECK(ideal.wrong == 0);
}

TEST_CASE("a map of another place finds nothing") {
  const Replay here(make_course(SceneKind::kOffice, {}, 1), {});
  const Replay there(make_course(SceneKind::kOffice, {}, 2), {});
  CameraParameters camera = camera_for(SceneKind::kOffice);
  camera.rate_hz = 0.2;
  const Rate rate = relocalise_all(here.drive(camera, 2), map_of(there.unchanged(), nullptr));
  CHECK(rate.found == 0);
  CHECK(rate.wrong == 0);
}
