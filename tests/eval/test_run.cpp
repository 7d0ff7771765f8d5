// The scorer with stages whose errors are known.
#include <cmath>
#include <memory>

#include "common/terminal/interrupt.hpp"
#include "eval/harness/run.hpp"
#include "tests/catch.hpp"
#include "tests/eval/small_drive.hpp"

using namespace understory;
using namespace understory::eval;

namespace {

/// A keyframe from every eight scans, without landmarks; one can be withheld.
class EveryEighth {
 public:
  explicit EveryEighth(std::uint64_t withheld) : withheld_(withheld) {}
  std::optional<model::Keyframe> add(const model::LandmarkScan& scan) {
    members_.push_back({scan.utime, scan.sequence, {}, Eigen::Matrix3d::Zero()});
    if (members_.size() < 8) return std::nullopt;
    model::Keyframe keyframe;
    keyframe.sequence = next_++;
    keyframe.members = std::exchange(members_, {});
    if (keyframe.sequence == withheld_) {
      ++count_withheld_;
      return std::nullopt;
    }
    return keyframe;
  }
  std::uint64_t count_withheld() const { return count_withheld_; }

 private:
  std::uint64_t withheld_;
  std::uint64_t next_ = 0;
  std::uint64_t count_withheld_ = 0;
  std::vector<model::KeyframeMember> members_;
};

/// Knows the truth and adds an offset to all poses but the first; can hold back its first keyframes
/// and refuse one.
class Displacing {
 public:
  struct Behaviour {
    double offset_m = 0.0;
    std::uint64_t first_map_after = 0;  ///< Keyframes up to this one are committed with it.
    std::uint64_t refused = ~0ULL;
  };
  Displacing(const eval::metrics::MapTruth& truth, const Behaviour& behaviour)
      : truth_(truth), behaviour_(behaviour) {}

  model::MapUpdate add(const model::Keyframe& keyframe) {
    model::MapUpdate update;
    update.keyframe_sequence = keyframe.sequence;
    update.status = model::MapUpdateStatus::kNotSure;
    if (keyframe.sequence == behaviour_.refused) return update;

    const std::size_t base = keyframe.members.front().sequence;
    geometry::SE2 pose = truth_.map_T_vehicle(base);
    if (!buffered_.empty() || !poses_.empty()) {
      pose =
          geometry::SE2(pose.translation() + Eigen::Vector2d(0, behaviour_.offset_m), pose.theta());
    }

    buffered_.push_back({keyframe.sequence, 0, pose, Eigen::Matrix3d::Identity()});
    update.map_T_vehicle = pose;
    update.covariance = Eigen::Matrix3d::Identity();

    if (keyframe.sequence < behaviour_.first_map_after) return update;
    update.status = model::MapUpdateStatus::kUpdated;
    poses_.insert(poses_.end(), buffered_.begin(), buffered_.end());
    buffered_.clear();
    return update;
  }
  std::vector<model::KeyframePose> trajectory() const { return poses_; }
  std::vector<model::MapLandmark> landmarks() const {
    model::MapLandmark landmark;
    landmark.id = 1;
    landmark.position_m = truth_.trunk_m(truth_.trunks_in_range()[0]) + Eigen::Vector2d(0.2, 0.0);
    return {landmark};
  }

 private:
  const eval::metrics::MapTruth& truth_;
  Behaviour behaviour_;
  std::vector<model::KeyframePose> buffered_;
  std::vector<model::KeyframePose> poses_;
};

eval::harness::Stages stages_of(const eval::metrics::MapTruth& truth,
                                const Displacing::Behaviour& behaviour, std::uint64_t withheld) {
  const auto keyframer = std::make_shared<EveryEighth>(withheld);
  const auto mapper = std::make_shared<Displacing>(truth, behaviour);
  return {
      {[=](const model::LandmarkScan& scan) { return keyframer->add(scan); },
       [] { return std::vector<model::Keyframe>(); }, [=] { return keyframer->count_withheld(); }},
      {[=](const model::Keyframe& keyframe) { return mapper->add(keyframe); },
       [=] { return mapper->trajectory(); }, [=] { return mapper->landmarks(); },
       [](eval::harness::SubmapShelf&) {}}};
}

eval::harness::RunResult run_with(const Displacing::Behaviour& behaviour,
                                  std::uint64_t withheld = ~0ULL) {
  static const eval::harness::RecordedDrive recorded(test::small_drive_parameters(),
                                                     1);  // 40 scans: five keyframes
  const eval::metrics::MapTruth truth(recorded.drive, 0);
  const std::atomic<bool> stop{false};
  return run_slam(recorded, stages_of(truth, behaviour, withheld), stop);
}

}  // namespace

TEST_CASE("A perfect mapper has no error, a displaced one what it was displaced by", "[run]") {
  const eval::harness::RunResult perfect = run_with({});
  CHECK(perfect.score.errors.rpe_m() < 1e-12);
  CHECK(perfect.score.updates == 5);
  CHECK(perfect.score.updates_possible == 5);
  CHECK(perfect.score.ate_m < 1e-9);
  CHECK(perfect.score.errors.lpe_m() == Approx(0.2));

  const eval::harness::RunResult displaced = run_with({.offset_m = 0.3});
  // States of 1 .. 5 poses, the first of each exact: 10 of 15 poses are off.
  CHECK(displaced.score.errors.poses == 15);
  CHECK(displaced.score.errors.rpe_m() == Approx(0.3 * 10.0 / 15.0));
  CHECK(displaced.score.wrong_updates == 0);
  REQUIRE(displaced.score.nees.size() == 5);
  CHECK(displaced.score.nees.back().second == Approx(0.09));
  CHECK(displaced.marks.back().bases == std::vector<std::size_t>{0, 8, 16, 24, 32});
  CHECK(displaced.marks.back().trunks.size() == 1);
}

TEST_CASE("Updates beyond a metre are wrong, each counted once", "[run]") {
  CHECK(run_with({.offset_m = 1.01}).score.wrong_updates == 4);
}

TEST_CASE("States of withheld keyframes are scored with the map as it is", "[run]") {
  const eval::harness::RunResult refused = run_with({.offset_m = 0.3, .refused = 2});
  CHECK(refused.score.updates == 4);
  CHECK(refused.score.keyframes_withheld == 1);
  CHECK(refused.score.errors.poses == 1 + 2 + 2 + 3 + 4);
  const eval::harness::RunResult withheld = run_with({.offset_m = 0.3}, 2);
  CHECK(withheld.score.updates == 4);
  CHECK(withheld.score.errors.poses == 1 + 2 + 2 + 3 + 4);
}

TEST_CASE("Keyframes buffered for the first map count when it is committed", "[run]") {
  const eval::harness::RunResult buffered = run_with({.offset_m = 2.0, .first_map_after = 2});
  CHECK(buffered.score.updates == 5);
  CHECK(buffered.score.errors.poses == 3 + 4 + 5);
  CHECK(buffered.score.wrong_updates == 4);
}

TEST_CASE("A run can be stopped", "[run]") {
  const eval::harness::RecordedDrive recorded(test::small_drive_parameters(), 1);
  const eval::metrics::MapTruth truth(recorded.drive, 0);
  const std::atomic<bool> stop{true};
  CHECK_THROWS_AS(run_slam(recorded, stages_of(truth, {}, ~0ULL), stop), terminal::Interrupted);
}
