// The state of the process, saved whole.
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/model/archive.hpp"
#include "services/existence_tracker/existence_tracker.hpp"

namespace understory::existence_tracker {
namespace {

constexpr state::Format kFormat{"existence_tracker", 7};

}  // namespace

std::string ExistenceTracker::save() const {
  std::string learned = encode(model_, births_so_far_);
  std::vector<model::LandmarkId> ids;
  std::vector<std::uint8_t> flags;
  std::vector<double> told;
  std::vector<double> looked_m;
  std::vector<double> began_m;
  std::vector<model::Utime> began;
  std::string points;
  for (const auto& [id, tracked] : points_) {
    ids.push_back(id);
    flags.push_back(
        static_cast<std::uint8_t>((tracked.is_in_use ? 1 : 0) | (tracked.was_told_in_use ? 2 : 0) |
                                  (tracked.state_is_due ? 4 : 0) | (tracked.is_first_pass ? 8 : 0) |
                                  (tracked.is_counted ? 16 : 0) | (tracked.has_just_left ? 32 : 0) |
                                  (tracked.judged_times == learned_times_ ? 64 : 0) |
                                  (tracked.is_among_histories ? 128 : 0)));
    told.push_back(tracked.told_probability);
    looked_m.push_back(tracked.looked_m);
    began_m.push_back(tracked.pass_began_m);
    began.push_back(tracked.pass_began_utime);
    points += encode(tracked);
  }
  return state::save(kFormat, learned, ids, flags, told, looked_m, began_m, began, points, places_,
                     need_, births_, counters_, last_m_, utime_, map_id_, along_m_, pass_began_m_,
                     learned_m_, repeated_, wants_map_, begins_drive_);
}

void ExistenceTracker::load(const std::string& state) {
  ExistenceTracker loaded(parameters_);
  std::string learned;
  std::vector<model::LandmarkId> ids;
  std::vector<std::uint8_t> flags;
  std::vector<double> told;
  std::vector<double> looked_m;
  std::vector<double> began_m;
  std::vector<model::Utime> began;
  std::string points;
  state::load(state, kFormat, learned, ids, flags, told, looked_m, began_m, began, points,
              loaded.places_, loaded.need_, loaded.births_, loaded.counters_, loaded.last_m_,
              loaded.utime_, loaded.map_id_, loaded.along_m_, loaded.pass_began_m_,
              loaded.learned_m_, loaded.repeated_, loaded.wants_map_, loaded.begins_drive_);
  if (flags.size() != ids.size() || told.size() != ids.size() || looked_m.size() != ids.size() ||
      began_m.size() != ids.size() || began.size() != ids.size() ||
      points.size() != ids.size() * point_bytes())
    throw std::invalid_argument("existence tracker state: its points do not fit their numbers");

  decode(learned, loaded.model_, loaded.births_so_far_);
  loaded.learned_times_ = 1;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::string_view bytes =
        std::string_view(points).substr(i * point_bytes(), point_bytes());
    TrackedPoint tracked = decode(loaded.model_, bytes, (flags[i] & 1U) != 0);
    tracked.was_told_in_use = (flags[i] & 2U) != 0;
    tracked.state_is_due = (flags[i] & 4U) != 0;
    tracked.is_first_pass = (flags[i] & 8U) != 0;
    tracked.is_counted = (flags[i] & 16U) != 0;
    tracked.has_just_left = (flags[i] & 32U) != 0;
    // The numbers of the rates begin anew: 1, of now, and 0.
    tracked.judged_times = (flags[i] & 64U) != 0 ? 1 : 0;
    tracked.is_among_histories = (flags[i] & 128U) != 0;
    if (tracked.is_among_histories)
      tracked.point.tell(loaded.histories_);
    else
      loaded.changed_.push_back(ids[i]);
    if (tracked.state_is_due) loaded.due_.push_back(ids[i]);
    tracked.told_probability = told[i];
    tracked.looked_m = looked_m[i];
    tracked.pass_began_m = began_m[i];
    tracked.pass_began_utime = began[i];
    loaded.unused_ += tracked.is_in_use ? 0 : 1;
    loaded.points_.emplace(ids[i], tracked);
  }
  *this = std::move(loaded);
}

}  // namespace understory::existence_tracker
