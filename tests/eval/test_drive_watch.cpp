// What `eval loops` and `eval shared-errors` say of a drive, on messages whose content is known.
#include <Eigen/Cholesky>
#include <random>

#include "eval/experiments/loops/drive_watch.hpp"
#include "eval/experiments/shared_errors/surveyed_drives.hpp"
#include "sim/random_streams.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::eval::experiments;

namespace {

/// A way of `frames` frames 2 m apart; frame i detects trees i, i + 1, i + 2.
loops::LoopDrive watched_drive(std::size_t frames) {
  loops::LoopDrive drive;
  for (std::size_t i = 0; i < frames; ++i) {
    const auto step = static_cast<double>(i);
    drive.truth.emplace_back(2.0 * step, 0.1 * step * step, 0.05 * step);
    model::LandmarkScan& scan = drive.scans.emplace_back();
    scan.utime = 1'000'000 * static_cast<model::Utime>(i + 1);
    scan.sequence = i;
    scan.detections.resize(3);
    const int first = static_cast<int>(i);
    drive.trees.push_back({first, first + 1, first + 2});
  }
  drive.tree_count = frames + 2;
  return drive;
}

/// Frame `i` with the landmark that each of its detections is.
model::MapUpdate seen(const loops::LoopDrive& drive, std::size_t i,
                      const std::vector<model::LandmarkId>& landmarks) {
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kUpdated;
  update.scans.push_back({drive.scans[i].utime, drive.scans[i].sequence});
  for (std::uint32_t k = 0; k < landmarks.size(); ++k)
    update.detections.push_back({0, k, landmarks[k]});
  return update;
}

model::WholeMap map_with(const std::vector<model::LandmarkId>& ids) {
  model::WholeMap map;
  for (const model::LandmarkId id : ids) map.landmarks.emplace_back().id = id;
  return map;
}

}  // namespace

TEST_CASE("Trees with two landmarks are counted in the final map, after its merges",
          "[drive-watch]") {
  const loops::LoopDrive drive = watched_drive(3);
  loops::DriveWatch watch(drive);
  watch.follow(seen(drive, 0, {10, 11, 12}));
  watch.follow(seen(drive, 1, {21, 12, 0}));   // tree 1 again as a landmark of its own
  watch.follow(seen(drive, 2, {32, 33, 34}));  // and tree 2
  const auto doubled = [&] { return watch.sum_up(map_with({10, 11, 12, 21, 32, 33, 34}), {}); };
  CHECK(doubled().trees == 5);
  CHECK(doubled().doubled == 2);

  // One merge told by an update, the other by a change of the map; each of them twice.
  model::MapUpdate update = seen(drive, 2, {});
  update.merged.emplace_back(21, 11);
  model::MapDelta delta;
  delta.merged = {{21, 11}, {32, 12}};
  watch.follow(update);
  watch.follow(delta);
  watch.follow(delta);
  const loops::DriveFate after = watch.sum_up(map_with({10, 11, 12, 33, 34}), {});
  CHECK(after.trees == 5);
  CHECK(after.doubled == 0);
}

TEST_CASE("NEES of keyframes is relative to the first, and 3 where covariances are true",
          "[drive-watch]") {
  const loops::LoopDrive drive = watched_drive(2000);
  const loops::DriveWatch watch(drive);
  const geometry::SE2 map_T_first(5.0, -2.0, 0.7);
  Eigen::Matrix3d root;
  root << 0.1, 0.0, 0.0, 0.03, 0.06, 0.0, 0.001, -0.002, 0.01;
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (const double factor : {1.0, 2.0}) {
    model::WholeMap map;
    for (std::size_t i = 0; i < drive.truth.size(); ++i) {
      const Eigen::Vector3d unit(normal(random), normal(random), normal(random));
      model::KeyframePose& keyframe = map.keyframes.emplace_back();
      keyframe.utime = drive.scans[i].utime;
      const geometry::SE2 truth = map_T_first * drive.truth[i];
      // The first one is the frame: exact, without a covariance.
      keyframe.map_T_vehicle = i == 0 ? truth : truth * geometry::SE2::Exp(factor * root * unit);
      if (i > 0) keyframe.covariance = root * root.transpose();
    }
    const loops::DriveFate fate = watch.sum_up(map, map_T_first);
    CHECK(fate.nees == Approx(3.0 * factor * factor).margin(0.25 * factor * factor));
    if (factor == 1.0) CHECK(fate.within_95_pct == Approx(95.0).margin(2.0));
    if (factor == 2.0) CHECK(fate.within_95_pct < 70.0);
  }
}

TEST_CASE("Live poses are those that were told first, in the last map, after alignment",
          "[drive-watch]") {
  const loops::LoopDrive drive = watched_drive(40);
  loops::DriveWatch watch(drive);
  const geometry::SE2 turned(3.0, 4.0, 1.0);
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    model::SlamPose pose;
    pose.utime = drive.scans[i].utime;
    pose.map_id = i < 10 ? 1 : 2;
    pose.map_T_submap = turned;
    // To and fro across the first half of the way: 0.2 m RMS, which no alignment takes away.
    const double aside_m = i % 2 == 0 ? 0.2 : -0.2;
    pose.submap_T_vehicle = i < 10 ? geometry::SE2(99.0, 0.0, 0.0)
                                   : geometry::SE2(Eigen::Vector2d(drive.truth[i].translation() +
                                                                   Eigen::Vector2d(0.0, aside_m)),
                                                   0.0);
    watch.follow(pose);
    pose.submap_T_vehicle = geometry::SE2(-50.0, 0.0, 0.0);
    watch.follow(pose);  // told again: too late
  }
  const loops::DriveFate fate = watch.sum_up({}, {});
  CHECK(fate.live_poses == 30);
  CHECK(fate.live_ate_m == Approx(0.2).margin(0.005));
}

TEST_CASE("Keyframes without a place, reasons and quarters are counted", "[drive-watch]") {
  const loops::LoopDrive drive = watched_drive(8);
  loops::DriveWatch watch(drive);
  using enum model::MapUpdateStatus;
  for (const auto status : {kFirstMap, kUpdated, kNotSure, kRolledBack, kRejected, kNotSure}) {
    model::MapUpdate update;
    update.status = status;
    watch.follow(update);
  }
  for (const char* reason : {"contradicts", "", "contradicts", "unknown end"}) {
    model::LoopResult result;
    result.reason = reason;
    watch.follow(result);
  }
  for (const double ms : {1.0, 3.0, 9.0, 9.0, 9.0, 9.0, 4.0, 5.0}) watch.frame_took(ms);
  const loops::DriveFate fate = watch.sum_up({}, {});
  CHECK(fate.rolled_back == 1);
  CHECK(fate.without_pose == 3);
  CHECK(fate.not_accepted ==
        std::map<std::string, std::size_t>{{"contradicts", 2}, {"unknown end", 1}});
  CHECK(fate.first_quarter_ms == Approx(2.0));
  CHECK(fate.last_quarter_ms == Approx(4.5));
}

TEST_CASE("A surveyed drive has the same stems with shared errors and with white ones",
          "[shared-errors]") {
  namespace surveys = shared_errors;
  surveys::Survey survey;
  sim::ForestParameters forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  forest.side_m = 250.0;
  auto random = sim::random_stream(5, sim::Stream::kForest);
  survey.forest = sim::make_forest(forest, random);
  surveys::SurveyedDrive drive{"small", "", "", "wander", 300.0, {}};
  drive.drive.detector.false_per_frame = 0.0;

  const auto power = [&](const char* errors, std::uint64_t seed) {
    const auto frames = surveys::drive_frames(drive, survey, *surveys::stem_errors(errors), seed);
    sim::StemDriveParameters exact = drive.drive;
    exact.detector.position_sigma_m = 0.0;
    const auto truth = sim::drive_stem_frames(
        survey.forest, sim::make_stem_way(sim::StemWay::kWander, survey.forest, 300.0, seed), exact,
        seed);
    REQUIRE(frames.size() == truth.size());
    double squared = 0.0;
    int count = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      REQUIRE(frames[i].stems.size() == truth[i].stems.size());
      for (std::size_t k = 0; k < frames[i].stems.size(); ++k) {
        squared += (frames[i].stems[k].position_m - truth[i].stems[k].position_m).squaredNorm();
        count += 2;
      }
    }
    return squared / count;
  };
  for (const char* errors : {"shared", "along", "direction", "range", "independent"}) {
    CAPTURE(errors);
    double mean = 0.0;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) mean += power(errors, seed) / 6.0;
    CHECK(std::sqrt(mean) == Approx(0.0542).margin(0.004));
  }
  CHECK_FALSE(surveys::stem_errors("none"));
}

TEST_CASE("The drives of shared-errors: six by default, all of them described", "[shared-errors]") {
  namespace surveys = shared_errors;
  const auto all = surveys::surveyed_drives();
  CHECK(surveys::usual_drives().size() == 6);
  CHECK(all.size() == 7);
  for (const std::string& name : surveys::usual_drives())
    CHECK(std::ranges::count(all, name, &surveys::SurveyedDrive::name) == 1);
  CHECK_THROWS_WITH(surveys::read_survey(all.front(), "no-such-folder"),
                    Catch::Matchers::Contains("longleaf.csv"));
}
