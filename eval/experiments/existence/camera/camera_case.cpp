#include "eval/experiments/existence/camera/camera_case.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "eval/experiments/existence/camera/projection.hpp"
#include "eval/experiments/existence/camera/tracker.hpp"
#include "sim/changes/changed_drive.hpp"
#include "sim/hash_random.hpp"

namespace understory::eval::experiments::existence::camera {
namespace {

namespace changes = sim::changes;

constexpr double kCaseDay_s = 86400.0;
constexpr int kOccludersAlone = 4;
/// Of the texture of walls, where they are bare.
constexpr double kBareShare = 0.1;
/// A point is scored from so many clear looks on, from so many directions that differ by this
/// much: the camera passes a point once in a drive.
constexpr int kClearLooks = 10;
constexpr std::size_t kClearDirections = 3;
constexpr float kCosineApart = 0.985F;  // 10 degrees

changes::Course course_of(const CaseSetting& setting, std::uint64_t seed) {
  changes::CourseParameters parameters;
  parameters.length_m = setting.forest_circle_m;
  parameters.margin_m = setting.forest_margin_m;
  return changes::make_course(setting.scene, parameters, seed);
}

changes::Diff diff_of(const CaseSetting& setting, const changes::Course& course,
                      std::uint64_t seed) {
  if (setting.changed == 0.0 && !setting.has_occluders_alone) return {};
  changes::DiffParameters parameters;
  if (setting.has_occluders_alone) parameters.occluders = kOccludersAlone;
  parameters.share = setting.changed;
  return changes::make_diff(course, parameters, seed);
}

changes::TextureParameters textures_of(const CaseSetting& setting) {
  changes::TextureParameters textures;
  if (setting.has_bare_walls) textures.structure_per_m2 *= kBareShare;
  return textures;
}

/// The frames of one drive: each begins at a moment of its own, so no two see from the same places.
std::vector<changes::CameraFrame> frames_of(const changes::Replay& replay,
                                            const changes::CameraParameters& camera,
                                            double frames_per_s, std::uint64_t seed) {
  changes::KeypointCamera eyes = replay.look(camera, seed);
  const double start_s = sim::uniform_of(sim::mixed(seed, 1)) / frames_per_s;
  const double duration_s = replay.motion().duration_s();
  std::vector<changes::CameraFrame> frames;
  for (double time_s = start_s; time_s < duration_s; time_s += 1.0 / frames_per_s) {
    const auto utime = static_cast<model::Utime>(std::llround(1e6 * time_s));
    frames.push_back(
        eyes.frame(replay.motion().at(time_s).world_T_vehicle(), frames.size(), utime));
  }
  return frames;
}

/// Lines of sight of one frame, in truth.
using ClearSights = std::unordered_map<changes::PointId, bool>;

ClearSights clear_sights(const changes::CameraFrame& frame) {
  ClearSights sights;
  for (const changes::ExpectedPoint& point : frame.expected) {
    const bool is_empty_place =
        point.sight == changes::Sight::kGone && point.occluder == changes::kGroundThing;
    // A point that was moved comes twice: first where it was mapped.
    sights.try_emplace(point.point, is_empty_place || point.sight == changes::Sight::kVisible);
  }
  return sights;
}

/// Turns the frames of the drives of a case into looks.
class Observing {
 public:
  Observing(CameraCase& result, const changes::Replay& replay, std::uint64_t seed)
      : result_(result),
        things_(changes::compare(replay.unchanged().scene, replay.copy().scene)),
        clear_(result.map.size(), 0),
        directions_(result.map.size()),
        seed_(seed) {}

  void mapping_drive(const std::vector<changes::CameraFrame>& frames) {
    begin(0.0);
    for (const changes::CameraFrame& frame : frames) add(frame, frame.world_T_camera, {});
    end(false);
  }
  /// Poses are those of a tracker in the old map, with its covariances.
  void changed_drive(const std::vector<changes::CameraFrame>& frames, double time_s) {
    begin(time_s);
    CameraTracker tracker(result_.camera, sim::mixed(seed_, result_.history.drives.size()));
    for (const changes::CameraFrame& frame : frames) {
      const Eigen::Isometry3d world_T_camera = tracker.track(frame, result_.map);
      add(frame, world_T_camera, {.covariance = tracker.covariance()});
    }
    end(true);
  }

 private:
  void begin(double time_s);
  void add(const changes::CameraFrame& frame, const Eigen::Isometry3d& world_T_camera,
           const PoseGate& gate);
  void look(const Expected& expected, const changes::CameraFrame& frame,
            const Eigen::Vector3d& eye_m, const ClearSights& sights);
  void end(bool is_changed);
  bool exists(const CameraPoint& point) const;

  CameraCase& result_;
  std::vector<changes::TrueThing> things_;
  std::vector<int> clear_;                                ///< Looks since the change, by point.
  std::vector<std::vector<Eigen::Vector3f>> directions_;  ///< Of those, each apart from the others.
  std::vector<int> looked_;                               ///< In this drive.
  std::vector<int> clear_this_drive_;
  std::uint64_t seed_;
};

void Observing::begin(double time_s) {
  result_.history.drives.emplace_back().time_s = time_s;
  result_.keypoints.emplace_back();
  looked_.assign(result_.map.size(), 0);
  clear_this_drive_.assign(result_.map.size(), 0);
}

void Observing::look(const Expected& expected, const changes::CameraFrame& frame,
                     const Eigen::Vector3d& eye_m, const ClearSights& sights) {
  const CameraPoint& point = result_.map[expected.point];
  LookEvent event;
  event.point = expected.point;
  event.look.from_point_m = (eye_m - point.position_m).cast<float>();
  event.is_seen = expected.keypoint != kNoKeypoint;
  if (!event.is_seen) event.look.ray = ray_beside(expected, frame.keypoints, result_.camera);
  const auto sight = sights.find(point.truth);
  event.is_clear = sight != sights.end() && sight->second;
  event.recall = result_.camera.recall;
  result_.history.drives.back().looks.push_back(event);

  ++looked_[event.point];
  if (!event.is_clear) return;
  ++clear_this_drive_[event.point];
  ++clear_[event.point];
  const Eigen::Vector3f direction = event.look.from_point_m.normalized();
  std::vector<Eigen::Vector3f>& known = directions_[event.point];
  const bool is_new = std::none_of(
      known.begin(), known.end(),
      [&direction](const Eigen::Vector3f& other) { return direction.dot(other) > kCosineApart; });
  if (is_new && known.size() < kClearDirections) known.push_back(direction);
}

void Observing::add(const changes::CameraFrame& frame, const Eigen::Isometry3d& world_T_camera,
                    const PoseGate& gate) {
  std::vector<Expected> expected = points_in_view(result_.map, world_T_camera, result_.camera);
  associate_within(expected, result_.map, frame.keypoints, result_.camera, gate);
  const ClearSights sights = clear_sights(frame);
  std::size_t taken = 0;
  for (const Expected& one : expected) {
    look(one, frame, world_T_camera.translation(), sights);
    taken += one.keypoint != kNoKeypoint ? 1 : 0;
  }
  result_.keypoints.back().all += frame.keypoints.size();
  result_.keypoints.back().without_point += frame.keypoints.size() - taken;
}

bool Observing::exists(const CameraPoint& point) const {
  const changes::ThingId thing = changes::thing_of(point.truth);
  const auto found = std::lower_bound(
      things_.begin(), things_.end(), thing,
      [](const changes::TrueThing& one, changes::ThingId id) { return one.id < id; });
  return found != things_.end() && found->id == thing &&
         found->state == changes::ThingState::kPresent;
}

void Observing::end(bool is_changed) {
  DriveLooks& drive = result_.history.drives.back();
  for (std::size_t i = 0; i < result_.map.size(); ++i) {
    const bool is_there = !is_changed || exists(result_.map[i]);
    const bool is_scored =
        is_changed && clear_[i] >= kClearLooks && directions_[i].size() >= kClearDirections;
    drive.truth.push_back(
        {is_there, is_scored, is_there && looked_[i] > 0 && clear_this_drive_[i] == 0});
  }
  if (is_changed) return;
  clear_.assign(clear_.size(), 0);
  directions_.assign(directions_.size(), {});
}

}  // namespace

std::string name_of_world(const CaseSetting& setting) {
  return std::string(changes::to_string(setting.scene)) +
         (setting.has_bare_walls ? ", bare walls" : "");
}

CameraCase make_case(const CaseSetting& setting, std::uint64_t seed, bool has_held_out) {
  const changes::Course course = course_of(setting, seed);
  const changes::Replay before(course, {}, textures_of(setting));
  const changes::Replay after(course, diff_of(setting, course, sim::mixed(seed, 2)),
                              textures_of(setting));
  CameraCase result;
  result.camera = changes::camera_for(setting.scene);
  const auto drive = [&](const changes::Replay& replay, std::uint64_t number) {
    return frames_of(replay, result.camera, setting.frames_per_s, sim::mixed(seed, 100 + number));
  };

  const std::vector<changes::CameraFrame> mapping = drive(before, 0);
  MapBuilder builder(result.camera);
  for (const changes::CameraFrame& frame : mapping) builder.add(frame);
  result.map = builder.finish();
  for (const CameraPoint& point : result.map)
    result.history.points_m.emplace_back(point.position_m.cast<float>());
  result.history.mapping_drives = 1;
  result.history.gone_share = setting.changed;

  Observing observing(result, after, seed);
  observing.mapping_drive(mapping);
  for (int k = 1; k <= setting.changed_drives; ++k)
    observing.changed_drive(drive(after, static_cast<std::uint64_t>(k)),
                            kCaseDay_s * (setting.gap_days + k - 1));
  if (has_held_out)
    result.held_out = drive(after, static_cast<std::uint64_t>(setting.changed_drives) + 1);
  return result;
}

History without_rays(History history) {
  for (DriveLooks& drive : history.drives)
    for (LookEvent& event : drive.looks) event.look.ray = understory::existence::Ray::kUnknown;
  return history;
}

}  // namespace understory::eval::experiments::existence::camera
