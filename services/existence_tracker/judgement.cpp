// What the landmarks teach of detector and world, what that says of each of them, and which of them
// are to be used.
#include <utility>

#include "services/existence_tracker/existence_tracker.hpp"

namespace understory::existence_tracker {
namespace {

/// Path after which what all landmarks teach is summed up [m].
constexpr double kLearnedEveryM = 100.0;
/// Share of what is new that must have been real for it to be used at once.
constexpr double kMostAreReal = 0.5;

}  // namespace

/// The time since the landmarks were looked at has passed for all of them. O(landmarks).
void ExistenceTracker::begin_drive(model::Utime utime) {
  learn();  // What the end of the drive before taught.
  for (auto& [id, tracked] : points_) {
    judge(id, tracked);
    count_false(tracked);
  }
  model_.begin_drive();
  for (auto& [id, tracked] : points_) {
    change(id, tracked);
    tracked.looked_m = tracked.pass_began_m = -1e9;
    tracked.pass_began_utime = kNever;
    tracked.is_first_pass = tracked.has_just_left = false;
    pass_time(utime, tracked);
    tracked.point.enter_pass(model_);
  }
  learn();
  for (auto& [id, tracked] : points_) judge(id, tracked);
  pass_began_m_ = along_m_;
}

/// How often a pass misses what is there, and how much goes, by what became of all landmarks.
/// O(what changed, histories that differ).
void ExistenceTracker::learn() {
  for (const model::LandmarkId id : std::exchange(changed_, {})) {
    const auto found = points_.find(id);
    if (found == points_.end() || found->second.is_among_histories) continue;
    found->second.point.tell(histories_);
    found->second.is_among_histories = true;
  }
  model_.learn(histories_);
  ++learned_times_;
  learned_m_ = along_m_;
}

/// Before a landmark's point changes.
void ExistenceTracker::change(model::LandmarkId id, TrackedPoint& tracked) {
  if (!std::exchange(tracked.is_among_histories, false)) return;
  tracked.point.take_back(histories_);
  changed_.push_back(id);
}

/// P anew by what was learned since it was last judged. What a drive missed that misses more than
/// others never left.
void ExistenceTracker::judge(model::LandmarkId id, TrackedPoint& tracked) {
  if (tracked.judged_times == learned_times_) return;
  change(id, tracked);
  tracked.point.reconsider(model_, tracked.judged_by);
  tracked.judged_by = model_.learned().before;
  tracked.judged_times = learned_times_;
  take_back(tracked);
  decide(tracked);
  touched_.push_back(id);
}

void ExistenceTracker::learn_on_the_way() {
  if (along_m_ - learned_m_ < kLearnedEveryM) return;
  learn();
  judge_around();
}

/// Landmarks that may come into view before the next sum: who places by them knows before.
void ExistenceTracker::judge_around() {
  const double radius_m = kLearnedEveryM + parameters_.model.range_m;
  for (const model::LandmarkId id : places_.near(*last_m_, radius_m))
    if (const auto found = points_.find(id); found != points_.end()) judge(id, found->second);
}

existence::PassHistories ExistenceTracker::histories() const {
  existence::PassHistories all = histories_;
  for (const auto& [id, tracked] : points_)
    if (!tracked.is_among_histories) tracked.point.tell(all);
  return all;
}

existence::PassHistories ExistenceTracker::recount() const {
  existence::PassHistories all;
  for (const auto& [id, tracked] : points_) tracked.point.tell(all);
  return all;
}

/// While most of what is new turns out to be false, it is not used before another pass saw it.
bool ExistenceTracker::may_be_used(const TrackedPoint& tracked) const {
  return tracked.is_confirmed || are_new_ones_used();
}

bool ExistenceTracker::are_new_ones_used() const {
  return births_so_far_.share(parameters_.model.birth) >= kMostAreReal;
}

/// What left use by looks of this pass that turn out to have been hidden never left.
void ExistenceTracker::take_back(TrackedPoint& tracked) {
  const bool is_probable = tracked.point.probability() >= parameters_.use.drop_below;
  if (!tracked.has_just_left || tracked.is_in_use || !is_probable || !may_be_used(tracked)) return;
  tracked.has_just_left = false;
  readmit(tracked);
}

void ExistenceTracker::readmit(TrackedPoint& tracked) {
  tracked.is_in_use = true;
  --unused_;
  ++counters_.readmitted;
}

void ExistenceTracker::decide(TrackedPoint& tracked) {
  const double probability = tracked.point.probability();
  const bool is_gone = probability < parameters_.use.drop_below;
  if (tracked.is_in_use && (is_gone || !may_be_used(tracked))) {
    tracked.is_in_use = false;
    tracked.has_just_left = true;
    ++unused_;
    ++counters_.dropped;
  } else if (!tracked.is_in_use && probability > parameters_.use.readmit_above &&
             may_be_used(tracked)) {
    readmit(tracked);
  }
}

}  // namespace understory::existence_tracker
