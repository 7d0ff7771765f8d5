#include "services/existence_tracker/existence_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/existence_tracker/seen_landmarks.hpp"

namespace understory::existence_tracker {
namespace {

constexpr std::size_t kStatesPerMessage = 200;
/// A step that no vehicle drives between two keyframes is a correction of the map [m].
constexpr double kLongestStepM = 50.0;
/// Looks from nearer or farther are none: the map is wrong there [m].
constexpr float kNearestM = 0.05F;
constexpr float kFarthestM = 1e4F;

std::optional<existence::Look> look_from(const Eigen::Vector2d& vehicle_m,
                                         const Eigen::Vector2d& landmark_m, existence::Ray ray) {
  const Eigen::Vector2f from_m = (vehicle_m - landmark_m).cast<float>();
  const float distance_m = from_m.norm();
  if (!(distance_m > kNearestM && distance_m < kFarthestM)) return std::nullopt;
  return existence::Look{Eigen::Vector3f(from_m.x(), from_m.y(), 0.0F), ray};
}

existence::Ray ray_of(model::LineOfSight sight) {
  switch (sight) {
    case model::LineOfSight::kBlocked:
      return existence::Ray::kBlocked;
    case model::LineOfSight::kClear:
      return existence::Ray::kPassed;
    default:
      return existence::Ray::kUnknown;
  }
}

bool has_place(const model::MapUpdate& update) {
  using enum model::MapUpdateStatus;
  return update.status == kFirstMap || update.status == kUpdated;
}

}  // namespace

ExistenceTracker::ExistenceTracker(const TrackerParameters& parameters)
    : parameters_(parameters), model_(parameters.model), need_(parameters.need) {}

void ExistenceTracker::begin_with(std::span<const model::ExistenceState> states) {
  existence::ExistenceModel model = model_;
  BirthCounts births_so_far;
  if (!states.empty()) decode(states.back().model, model, births_so_far);
  std::map<model::LandmarkId, TrackedPoint> points;
  std::uint32_t unused = 0;
  for (const model::ExistenceState& state : states) {
    for (std::size_t i = 0; i < state.landmarks.size(); ++i) {
      const model::LandmarkExistence& one = state.landmarks[i];
      TrackedPoint tracked = decode(model, state.state_of(i), one.is_in_use);
      tracked.told_probability = one.probability;
      points.insert_or_assign(one.id, tracked);
    }
  }

  // Who holds the map does not know yet which are not in use.
  touched_.clear();
  for (const auto& [id, tracked] : points) {
    if (tracked.is_in_use) continue;
    touched_.push_back(id);
    ++unused;
  }
  model_ = model;
  births_so_far_ = births_so_far;
  points_ = std::move(points);
  histories_ = {};
  changed_.clear();
  due_.clear();
  ++learned_times_;  // What P of each follows is its own.
  for (auto& [id, tracked] : points_) changed_.push_back(id);
  unused_ = unused;
  begins_drive_ = true;
  need_.know(points_.size());
}

void ExistenceTracker::pass_time(model::Utime utime, TrackedPoint& tracked) const {
  const double seconds = 1e-6 * static_cast<double>(utime - tracked.looked_utime);
  if (seconds > 0.0) tracked.point.elapse(model_, model_.elapsed(seconds));
  tracked.looked_utime = std::max(tracked.looked_utime, utime);
}

void ExistenceTracker::take(const model::WholeMap& map) {
  places_.take(map);
  wants_map_ = wants_map_ && !map.complete;
  give_birth();
}

void ExistenceTracker::take(const model::MapDelta& delta) {
  places_.take(delta);
  give_birth();
}

std::optional<model::Existence> ExistenceTracker::add(const model::MapUpdate& update) {
  if (!has_place(update)) return std::nullopt;
  utime_ = update.utime;
  map_id_ = update.map_id;
  if (std::exchange(begins_drive_, false)) begin_drive(update.utime);
  drive_to(update);
  forget(update);

  // What was seen, and what was not. New landmarks wait until it is known where they are.
  const Eigen::Vector2d vehicle_m = update.map_T_vehicle.translation();
  std::vector<model::LandmarkId> added = update.added;
  std::ranges::sort(added);
  for (const model::LandmarkId id : added) births_.push_back({id, vehicle_m, update.utime});
  for (const model::LandmarkId id : seen_landmarks(update))
    if (!std::ranges::binary_search(added, id)) look(id, true, existence::Ray::kUnknown, update);

  const bool knows_where =
      update.inliers >= static_cast<std::uint32_t>(parameters_.looks.min_inliers);
  if (knows_where && !update.is_lost)
    for (const model::ExpectedLandmark& one : update.expected)
      look(one.id, false,
           parameters_.looks.use_ranges ? ray_of(one.sight) : existence::Ray::kUnknown, update);
  return tell(update);
}

/// A pass is a way through a place: after so much path the next one begins.
void ExistenceTracker::drive_to(const model::MapUpdate& update) {
  const Eigen::Vector2d now_m = update.map_T_vehicle.translation();
  if (last_m_) along_m_ += std::min(kLongestStepM, (now_m - *last_m_).norm());
  last_m_ = now_m;
  need_.drive_to(along_m_);
  learn_on_the_way();
  if (along_m_ - pass_began_m_ < parameters_.looks.pass_m) return;
  model_.begin_pass();
  pass_began_m_ = along_m_;
}

void ExistenceTracker::look(model::LandmarkId id, bool is_hit, existence::Ray ray,
                            const model::MapUpdate& update) {
  const auto place_m = places_.at(id);
  if (!place_m) {
    ++counters_.without_place;
    wants_map_ = true;
    return;
  }
  auto look = look_from(update.map_T_vehicle.translation(), *place_m, ray);
  if (!look) return;

  TrackedPoint& tracked = known(id, update.utime);
  judge(id, tracked);
  change(id, tracked);
  pass_time(update.utime, tracked);
  const double before = tracked.point.probability();
  const bool was_in_use = tracked.is_in_use;
  look->goes_on = goes_on(tracked, update.utime);
  if (!look->goes_on) {
    count_false(tracked);
    if (tracked.is_first_pass) need_.know(1);
    tracked.is_first_pass = tracked.has_just_left = false;
  }
  if (is_hit) {
    confirm(tracked);
    tracked.point.hit(model_, *look);
    ++counters_.hits;
  } else {
    tracked.point.miss(model_, *look);
    ++counters_.misses;
    counters_.blocked += ray == existence::Ray::kBlocked ? 1 : 0;
    counters_.clear += ray == existence::Ray::kPassed ? 1 : 0;
  }
  make_due(id, tracked);
  if (ray == existence::Ray::kBlocked) take_back(tracked);
  decide(tracked);
  touched_.push_back(id);

  // What is known to be gone, or was hidden, is not missing.
  if (is_hit || (was_in_use && ray != existence::Ray::kBlocked))
    count_need(id, tracked, is_hit, before);
}

/// `before`: P before the look. What is not used yet is not new.
void ExistenceTracker::count_need(model::LandmarkId id, const TrackedPoint& tracked, bool is_hit,
                                  double before) {
  const bool is_new =
      tracked.is_first_pass && along_m_ - tracked.pass_began_m < parameters_.need.window_m;
  const double now = tracked.is_in_use ? tracked.point.probability() : 0.0;
  if (is_new) {
    need_.look_at_new(id, is_hit, now, along_m_);
  } else {
    need_.look_for(id, is_hit, before, along_m_);
  }
}

/// Whether the landmark's pass goes on: one in view where the vehicle's pass ends is not looked at
/// in two of them, nor is one that a drive comes back to: lanes side by side see it or miss it for
/// one reason, and say nothing of how often another drive does.
bool ExistenceTracker::goes_on(TrackedPoint& tracked, model::Utime utime) const {
  const LookParameters& looks = parameters_.looks;
  const bool is_in_view = along_m_ - tracked.looked_m < looks.same_pass_m &&
                          along_m_ - tracked.pass_began_m < looks.pass_m;
  const double since_s =
      1e-6 * (static_cast<double>(utime) - static_cast<double>(tracked.pass_began_utime));
  tracked.looked_m = along_m_;
  if (is_in_view || since_s < looks.pass_s) return true;
  tracked.pass_began_m = along_m_;
  tracked.pass_began_utime = utime;
  return false;
}

/// The landmark's point; of a given map it is new here.
TrackedPoint& ExistenceTracker::known(model::LandmarkId id, model::Utime utime) {
  const auto [found, is_new] = points_.try_emplace(id, TrackedPoint{Point::known(model_), utime});
  if (!is_new) return found->second;
  begin(id, found->second);
  // It was in the map before this drive.
  need_.know(1);
  found->second.told_probability = found->second.point.probability();
  return found->second;
}

/// A point that is new here: it follows what is known.
void ExistenceTracker::begin(model::LandmarkId id, TrackedPoint& tracked) {
  tracked.judged_by = model_.learned().before;
  tracked.judged_times = learned_times_;
  tracked.is_among_histories = false;
  changed_.push_back(id);
  due_.push_back(id);
}

void ExistenceTracker::make_due(model::LandmarkId id, TrackedPoint& tracked) {
  if (!std::exchange(tracked.state_is_due, true)) due_.push_back(id);
}

/// Seen by another pass than the one that found it.
void ExistenceTracker::confirm(TrackedPoint& tracked) {
  if (tracked.is_confirmed || tracked.is_first_pass) return;
  tracked.is_confirmed = true;
  births_so_far_.confirmed += 1.0;
}

/// Looked for by another pass that is over, and improbable. In its first pass nothing counts:
/// nothing can be confirmed there either.
void ExistenceTracker::count_false(TrackedPoint& tracked) {
  if (tracked.is_confirmed || tracked.is_first_pass || tracked.is_counted) return;
  if (tracked.point.probability() >= parameters_.use.drop_below) return;
  tracked.is_counted = true;
  births_so_far_.false_ones += 1.0;
}

/// Landmarks whose first sighting is some keyframes old get their probability now.
void ExistenceTracker::give_birth() {
  std::erase_if(births_, [&](const Birth& birth) {
    const auto place_m = places_.at(birth.id);
    if (!place_m) return false;
    const auto look = look_from(birth.vehicle_m, *place_m, existence::Ray::kUnknown);
    if (!look) return true;
    TrackedPoint born{Point::born(model_, *look), birth.utime};
    born.is_first_pass = true;
    born.is_confirmed = false;
    born.looked_m = born.pass_began_m = along_m_;
    born.pass_began_utime = birth.utime;
    const auto [found, is_new] = points_.try_emplace(birth.id, born);
    if (is_new) {
      begin(birth.id, found->second);
      decide(found->second);
    }
    touched_.push_back(birth.id);
    return true;
  });
}

void ExistenceTracker::forget(const model::MapUpdate& update) {
  const auto erase = [&](model::LandmarkId id) {
    std::erase_if(births_, [&](const Birth& birth) { return birth.id == id; });
    const auto found = points_.find(id);
    if (found == points_.end()) return;
    if (!found->second.is_in_use) --unused_;
    if (found->second.is_among_histories) found->second.point.take_back(histories_);
    points_.erase(found);
  };
  for (const model::LandmarkId id : update.removed) erase(id);

  // Two names of one thing: what speaks for it counts.
  for (const auto& [old_id, new_id] : update.merged) {
    const auto before = points_.find(old_id);
    if (before == points_.end()) {
      erase(old_id);  // It was not born yet.
      continue;
    }
    judge(old_id, before->second);
    const auto after = points_.find(new_id);
    if (after == points_.end()) {
      TrackedPoint moved = before->second;
      erase(old_id);
      if (!moved.is_in_use) ++unused_;
      moved.state_is_due = true;
      begin(new_id, points_.emplace(new_id, moved).first->second);
      continue;
    }
    judge(new_id, after->second);
    if (before->second.point.log_odds() > after->second.point.log_odds()) {
      change(new_id, after->second);
      after->second.point = before->second.point;
      make_due(new_id, after->second);
      decide(after->second);
    }
    erase(old_id);
  }
}

model::Existence ExistenceTracker::tell(const model::MapUpdate& update) {
  model::Existence existence;
  existence.utime = update.utime;
  existence.map_id = update.map_id;
  existence.known = static_cast<std::uint32_t>(points_.size());
  existence.unused = unused_;
  // Beyond what drives have missed, not what this one misses.
  const double usual = model_.learned().before;
  const double recall = usual > 0.0 ? usual : model_.recall().of_pass();
  existence.missing_share = need_.missing_share(recall);
  existence.new_share = need_.new_share();
  existence.is_mapping_needed = need_.is_needed(recall);

  for (const model::LandmarkId id : ids_to_tell()) {
    TrackedPoint& tracked = points_.at(id);
    judge(id, tracked);
    tracked.told_probability = tracked.point.probability();
    tracked.was_told_in_use = tracked.is_in_use;
    existence.landmarks.push_back({id, tracked.told_probability, tracked.is_in_use});
  }
  existence.is_whole = existence.landmarks.size() == points_.size();
  tell_new(update.utime, existence);
  return existence;
}

/// What this keyframe added is told at once, before it is known where it is: else it would be in
/// use until the next keyframe, and after a drive's last one until the next drive.
void ExistenceTracker::tell_new(model::Utime utime, model::Existence& existence) const {
  for (const Birth& birth : births_)
    if (birth.utime == utime && !points_.contains(birth.id))
      existence.landmarks.push_back({birth.id, model_.birth(), are_new_ones_used()});
  std::ranges::sort(existence.landmarks, {}, &model::LandmarkExistence::id);
}

/// What changed, and some of the others: who missed a message has all of them in the end.
std::set<model::LandmarkId> ExistenceTracker::ids_to_tell() {
  std::set<model::LandmarkId> ids;
  for (const model::LandmarkId id : std::exchange(touched_, {})) {
    const auto found = points_.find(id);
    if (found == points_.end()) continue;  // Born since the last keyframe, and merged by this one.
    const TrackedPoint& tracked = found->second;
    const double change = std::abs(tracked.point.probability() - tracked.told_probability);
    if (change > parameters_.output.told_change || tracked.is_in_use != tracked.was_told_in_use)
      ids.insert(id);
  }

  auto next = points_.upper_bound(repeated_);
  for (int i = 0; i < parameters_.output.repeated && !points_.empty(); ++i, ++next) {
    if (next == points_.end()) next = points_.begin();
    ids.insert(next->first);
    repeated_ = next->first;
  }
  return ids;
}

std::vector<model::ExistenceState> ExistenceTracker::take_states() {
  std::vector<model::ExistenceState> messages;
  std::vector<model::LandmarkId> ids = std::exchange(due_, {});
  std::ranges::sort(ids);
  for (const model::LandmarkId id : ids) {
    const auto found = points_.find(id);
    if (found == points_.end() || !std::exchange(found->second.state_is_due, false)) continue;
    TrackedPoint& tracked = found->second;
    judge(id, tracked);
    if (messages.empty() || messages.back().landmarks.size() == kStatesPerMessage) {
      messages.push_back({utime_, 0, map_id_, {}, encode(model_, births_so_far_), {}});
      messages.back().landmarks.reserve(kStatesPerMessage);
    }
    messages.back().landmarks.push_back({id, tracked.point.probability(), tracked.is_in_use});
    messages.back().states += encode(tracked);
  }
  return messages;
}

std::optional<model::LandmarkExistence> ExistenceTracker::of(model::LandmarkId id) const {
  const auto found = points_.find(id);
  if (found == points_.end()) return std::nullopt;
  const TrackedPoint& tracked = found->second;
  Point point = tracked.point;
  if (tracked.judged_times != learned_times_) {
    existence::ExistenceModel model = model_;
    point.reconsider(model, tracked.judged_by);
  }
  return model::LandmarkExistence{id, point.probability(), tracked.is_in_use};
}

}  // namespace understory::existence_tracker
