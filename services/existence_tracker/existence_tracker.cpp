#include "services/existence_tracker/existence_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/existence_tracker/seen_landmarks.hpp"

namespace understory::existence_tracker {
namespace {

constexpr std::size_t kStatesPerMessage = 200;
/// A look from a smaller or larger distance is ignored: the map is wrong there [m].
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
    : parameters_(parameters),
      need_(parameters.need),
      lessons_(parameters.model),
      use_(parameters.use),
      news_(parameters.output) {}

void ExistenceTracker::begin_with(std::span<const model::ExistenceState> states) {
  Lessons lessons = lessons_;
  lessons.begin_anew();
  if (!states.empty()) lessons.take(states.back().model);
  PointsById points;
  for (const model::ExistenceState& state : states) {
    for (std::size_t i = 0; i < state.landmarks.size(); ++i) {
      const model::LandmarkExistence& one = state.landmarks[i];
      TrackedPoint tracked = decode(lessons.model(), state.state_of(i), one.is_in_use);
      tracked.told_probability = one.probability;
      points.insert_or_assign(one.id, tracked);
    }
  }

  news_.begin_anew();
  use_.begin_anew();
  for (auto& [id, tracked] : points) {
    lessons.restore(id, tracked, false);  // P of each follows its own estimate.
    use_.add(tracked);
    // Subscribers do not know yet which ones are out of use.
    if (!tracked.is_in_use) news_.touch(id);
  }
  lessons_ = std::move(lessons);
  points_ = std::move(points);
  last_.begins_drive = true;
  need_.know(points_.size());
}

void ExistenceTracker::pass_time(model::Utime utime, TrackedPoint& tracked) const {
  const double seconds = 1e-6 * static_cast<double>(utime - tracked.looked_utime);
  if (seconds > 0.0) tracked.point.elapse(lessons_.model(), lessons_.model().elapsed(seconds));
  tracked.looked_utime = std::max(tracked.looked_utime, utime);
}

void ExistenceTracker::on_map(const model::WholeMap& map) {
  places_.take(map);
  wants_map_ = wants_map_ && !map.complete;
  give_birth();
}

void ExistenceTracker::on_delta(const model::MapDelta& delta) {
  places_.take(delta);
  give_birth();
}

std::optional<model::Existence> ExistenceTracker::on_update(const model::MapUpdate& update) {
  if (!has_place(update)) return std::nullopt;
  last_.utime = update.utime;
  last_.map_id = update.map_id;
  if (std::exchange(last_.begins_drive, false)) begin_drive(update.utime);
  drive_to(update);
  forget(update);

  // Seen and missed landmarks. New landmarks wait until their position is known.
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

void ExistenceTracker::drive_to(const model::MapUpdate& update) {
  path_.drive_to(update.map_T_vehicle.translation());
  need_.drive_to(path_.along_m());
  learn_on_the_way();
  if (path_.of_pass_m() < parameters_.looks.pass_m) return;
  lessons_.model().begin_pass();
  path_.begin_pass();
}

void ExistenceTracker::look(model::LandmarkId id, bool is_hit, existence::Ray ray,
                            const model::MapUpdate& update) {
  const auto place_m = places_.at(id);
  if (!place_m) {
    ++looks_.without_place;
    wants_map_ = true;
    return;
  }
  auto look = look_from(update.map_T_vehicle.translation(), *place_m, ray);
  if (!look) return;

  TrackedPoint& tracked = known(id, update.utime);
  judge(id, tracked);
  lessons_.change(id, tracked);
  pass_time(update.utime, tracked);
  const double before = tracked.point.probability();
  const bool was_in_use = tracked.is_in_use;
  look->goes_on = goes_on(tracked, update.utime);
  if (!look->goes_on) {
    lessons_.count_false(tracked, parameters_.use.drop_below);
    if (tracked.is_first_pass) need_.know(1);
    tracked.is_first_pass = tracked.has_just_left = false;
  }
  if (is_hit) {
    lessons_.confirm(tracked);
    tracked.point.hit(lessons_.model(), *look);
    ++looks_.hits;
  } else {
    tracked.point.miss(lessons_.model(), *look);
    ++looks_.misses;
    looks_.blocked += ray == existence::Ray::kBlocked ? 1 : 0;
    looks_.clear += ray == existence::Ray::kPassed ? 1 : 0;
  }
  news_.make_due(id, tracked);
  if (ray == existence::Ray::kBlocked) use_.take_back(tracked, may_be_used(tracked));
  use_.decide(tracked, may_be_used(tracked));
  news_.touch(id);

  // A landmark that is out of use, or was occluded, is not missing.
  if (is_hit || (was_in_use && ray != existence::Ray::kBlocked))
    count_need(id, tracked, is_hit, before);
}

/// `before`: P before the look. A landmark that is not used yet is not new.
void ExistenceTracker::count_need(model::LandmarkId id, const TrackedPoint& tracked, bool is_hit,
                                  double before) {
  const bool is_new =
      tracked.is_first_pass && path_.along_m() - tracked.pass_began_m < parameters_.need.window_m;
  const double now = tracked.is_in_use ? tracked.point.probability() : 0.0;
  if (is_new) {
    need_.look_at_new(id, is_hit, now, path_.along_m());
  } else {
    need_.look_for(id, is_hit, before, path_.along_m());
  }
}

/// Whether the landmark's pass continues. A landmark in view when the vehicle's pass ends belongs
/// to one of the two passes only. A return within the same drive continues the pass, too:
/// neighbouring lanes see or miss a landmark for the same reason, and do not show how often another
/// drive does.
bool ExistenceTracker::goes_on(TrackedPoint& tracked, model::Utime utime) const {
  const LookParameters& looks = parameters_.looks;
  const bool is_in_view = path_.along_m() - tracked.looked_m < looks.same_pass_m &&
                          path_.along_m() - tracked.pass_began_m < looks.pass_m;
  const double since_s =
      1e-6 * (static_cast<double>(utime) - static_cast<double>(tracked.pass_began_utime));
  tracked.looked_m = path_.along_m();
  if (is_in_view || since_s < looks.pass_s) return true;
  tracked.pass_began_m = path_.along_m();
  tracked.pass_began_utime = utime;
  return false;
}

/// The landmark's point; one of a given map gets a new point.
TrackedPoint& ExistenceTracker::known(model::LandmarkId id, model::Utime utime) {
  const auto [found, is_new] =
      points_.try_emplace(id, TrackedPoint{Point::known(lessons_.model()), utime});
  if (!is_new) return found->second;
  begin(id, found->second);
  // It was in the map before this drive.
  need_.know(1);
  found->second.told_probability = found->second.point.probability();
  return found->second;
}

/// Adds a new point.
void ExistenceTracker::begin(model::LandmarkId id, TrackedPoint& tracked) {
  lessons_.begin(id, tracked);
  news_.begin(id);
}

/// Landmarks whose first sighting is some keyframes old get their probability now.
void ExistenceTracker::give_birth() {
  std::erase_if(births_, [&](const Birth& birth) {
    const auto place_m = places_.at(birth.id);
    if (!place_m) return false;
    const auto look = look_from(birth.vehicle_m, *place_m, existence::Ray::kUnknown);
    if (!look) return true;
    TrackedPoint born{Point::born(lessons_.model(), *look), birth.utime};
    born.is_first_pass = true;
    born.is_confirmed = false;
    born.looked_m = born.pass_began_m = path_.along_m();
    born.pass_began_utime = birth.utime;
    const auto [found, is_new] = points_.try_emplace(birth.id, born);
    if (is_new) {
      begin(birth.id, found->second);
      use_.decide(found->second, may_be_used(found->second));
    }
    news_.touch(birth.id);
    return true;
  });
}

void ExistenceTracker::erase(model::LandmarkId id) {
  std::erase_if(births_, [&](const Birth& birth) { return birth.id == id; });
  const auto found = points_.find(id);
  if (found == points_.end()) return;
  use_.erase(found->second);
  lessons_.forget(found->second);
  points_.erase(found);
}

void ExistenceTracker::forget(const model::MapUpdate& update) {
  for (const model::LandmarkId id : update.removed) erase(id);
  for (const auto& [old_id, new_id] : update.merged) merge(old_id, new_id);
}

/// Two ids of one landmark: evidence for it is kept.
void ExistenceTracker::merge(model::LandmarkId old_id, model::LandmarkId new_id) {
  const auto before = points_.find(old_id);
  if (before == points_.end()) return erase(old_id);  // It had no point yet.
  judge(old_id, before->second);
  const auto after = points_.find(new_id);
  if (after == points_.end()) {
    TrackedPoint moved = before->second;
    erase(old_id);
    use_.add(moved);
    moved.state_is_due = true;
    return begin(new_id, points_.emplace(new_id, moved).first->second);
  }

  judge(new_id, after->second);
  if (before->second.point.log_odds() > after->second.point.log_odds()) {
    lessons_.change(new_id, after->second);
    after->second.point = before->second.point;
    news_.make_due(new_id, after->second);
    use_.decide(after->second, may_be_used(after->second));
  }
  erase(old_id);
}

model::Existence ExistenceTracker::tell(const model::MapUpdate& update) {
  model::Existence existence;
  existence.utime = update.utime;
  existence.map_id = update.map_id;
  existence.known = static_cast<std::uint32_t>(points_.size());
  existence.unused = use_.unused();
  // Beyond the misses of earlier drives; this drive's misses are excluded.
  const existence::ExistenceModel& model = lessons_.model();
  const double usual = model.learned().before;
  const double recall = usual > 0.0 ? usual : model.recall().of_pass();
  existence.missing_share = need_.missing_share(recall);
  existence.new_share = need_.new_share();
  existence.is_mapping_needed = need_.is_needed(recall);

  for (const model::LandmarkId id : news_.take_ids(points_)) {
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

/// Publishes landmarks that this keyframe added at once, before their position is known: else they
/// would be in use until the next keyframe, and after the last one of a drive until the next drive.
void ExistenceTracker::tell_new(model::Utime utime, model::Existence& existence) const {
  for (const Birth& birth : births_)
    if (birth.utime == utime && !points_.contains(birth.id))
      existence.landmarks.push_back(
          {birth.id, lessons_.model().birth(), lessons_.are_new_ones_used()});
  std::ranges::sort(existence.landmarks, {}, &model::LandmarkExistence::id);
}

std::vector<model::ExistenceState> ExistenceTracker::take_states() {
  std::vector<model::ExistenceState> messages;
  for (const model::LandmarkId id : news_.take_due()) {
    const auto found = points_.find(id);
    if (found == points_.end() || !std::exchange(found->second.state_is_due, false)) continue;
    TrackedPoint& tracked = found->second;
    judge(id, tracked);
    if (messages.empty() || messages.back().landmarks.size() == kStatesPerMessage) {
      messages.push_back({last_.utime, 0, last_.map_id, {}, lessons_.encoded(), {}});
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
  if (!lessons_.is_judged(tracked)) {
    existence::ExistenceModel model = lessons_.model();
    point.reconsider(model, tracked.judged_by);
  }
  return model::LandmarkExistence{id, point.probability(), tracked.is_in_use};
}

}  // namespace understory::existence_tracker
