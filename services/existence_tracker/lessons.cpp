#include "services/existence_tracker/lessons.hpp"

#include <utility>

namespace understory::existence_tracker {
namespace {

/// Least share of real ones among new landmarks for using new ones at once.
constexpr double kMostAreReal = 0.5;

}  // namespace

void Lessons::begin(model::LandmarkId id, TrackedPoint& tracked) {
  tracked.judged_by = model_.learned().before;
  tracked.judged_times = learned_times_;
  tracked.is_among_histories = false;
  changed_.push_back(id);
}

void Lessons::change(model::LandmarkId id, TrackedPoint& tracked) {
  if (!std::exchange(tracked.is_among_histories, false)) return;
  tracked.point.take_back(histories_);
  changed_.push_back(id);
}

void Lessons::forget(const TrackedPoint& tracked) {
  if (tracked.is_among_histories) tracked.point.take_back(histories_);
}

void Lessons::learn(PointsById& points, double along_m) {
  for (const model::LandmarkId id : std::exchange(changed_, {})) {
    const auto found = points.find(id);
    if (found == points.end() || found->second.is_among_histories) continue;
    found->second.point.tell(histories_);
    found->second.is_among_histories = true;
  }
  model_.learn(histories_);
  ++learned_times_;
  learned_m_ = along_m;
}

bool Lessons::judge(model::LandmarkId id, TrackedPoint& tracked) {
  if (is_judged(tracked)) return false;
  change(id, tracked);
  tracked.point.reconsider(model_, tracked.judged_by);
  tracked.judged_by = model_.learned().before;
  tracked.judged_times = learned_times_;
  return true;
}

void Lessons::confirm(TrackedPoint& tracked) {
  if (tracked.is_confirmed || tracked.is_first_pass) return;
  tracked.is_confirmed = true;
  births_.confirmed += 1.0;
}

void Lessons::count_false(TrackedPoint& tracked, double improbable) {
  if (tracked.is_confirmed || tracked.is_first_pass || tracked.is_counted) return;
  if (tracked.point.probability() >= improbable) return;
  tracked.is_counted = true;
  births_.false_ones += 1.0;
}

bool Lessons::are_new_ones_used() const { return births_.share(expected_birth_) >= kMostAreReal; }

existence::PassHistories Lessons::histories(const PointsById& points) const {
  existence::PassHistories all = histories_;
  for (const auto& [id, tracked] : points)
    if (!tracked.is_among_histories) tracked.point.tell(all);
  return all;
}

void Lessons::begin_anew() {
  births_ = {};
  histories_ = {};
  changed_.clear();
  ++learned_times_;
}

void Lessons::restore(model::LandmarkId id, TrackedPoint& tracked, bool is_judged) {
  tracked.judged_times = is_judged ? learned_times_ : 0;
  if (tracked.is_among_histories)
    tracked.point.tell(histories_);
  else
    changed_.push_back(id);
}

}  // namespace understory::existence_tracker
