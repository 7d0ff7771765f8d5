// Statistics of the landmarks, and their effect on each landmark.
#include "services/existence_tracker/existence_tracker.hpp"

namespace understory::existence_tracker {
namespace {

/// Path length between evaluations of the statistics [m].
constexpr double kLearnedEveryM = 100.0;

}  // namespace

/// The time since the last looks has passed for all landmarks. O(landmarks).
void ExistenceTracker::begin_drive(model::Utime utime) {
  lessons_.learn(points_,
                 path_.along_m());  // From the end of the drive before.
  for (auto& [id, tracked] : points_) {
    judge(id, tracked);
    lessons_.count_false(tracked, parameters_.use.drop_below);
  }
  lessons_.model().begin_drive();
  for (auto& [id, tracked] : points_) {
    lessons_.change(id, tracked);
    tracked.looked_m = tracked.pass_began_m = -1e9;
    tracked.pass_began_utime = kNever;
    tracked.is_first_pass = tracked.has_just_left = false;
    pass_time(utime, tracked);
    tracked.point.enter_pass(lessons_.model());
  }
  lessons_.learn(points_, path_.along_m());
  for (auto& [id, tracked] : points_) judge(id, tracked);
  path_.begin_pass();
}

/// Updates P with the estimates since its last update. Landmarks missed by a drive that misses more
/// than usual are put back into use.
void ExistenceTracker::judge(model::LandmarkId id, TrackedPoint& tracked) {
  if (!lessons_.judge(id, tracked)) return;
  use_.take_back(tracked, may_be_used(tracked));
  use_.decide(tracked, may_be_used(tracked));
  news_.touch(id);
}

void ExistenceTracker::learn_on_the_way() {
  if (path_.along_m() - lessons_.learned_m() < kLearnedEveryM) return;
  lessons_.learn(points_, path_.along_m());
  judge_around();
}

/// Landmarks that may come into view before the next evaluation: so their state is published before
/// they are used for localisation.
void ExistenceTracker::judge_around() {
  const double radius_m = kLearnedEveryM + parameters_.model.range_m;
  for (const model::LandmarkId id : places_.near(path_.place_m(), radius_m))
    if (const auto found = points_.find(id); found != points_.end()) judge(id, found->second);
}

existence::PassHistories ExistenceTracker::recount() const {
  existence::PassHistories all;
  for (const auto& [id, tracked] : points_) tracked.point.tell(all);
  return all;
}

}  // namespace understory::existence_tracker
