// The state of the process, saved whole.
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/model/archive.hpp"
#include "services/existence_tracker/existence_tracker.hpp"

namespace understory::existence_tracker {
namespace {

constexpr state::Format kFormat{"existence_tracker", 8};

}  // namespace

std::string ExistenceTracker::save() const {
  std::string learned = lessons_.encoded();
  std::vector<model::LandmarkId> ids;
  std::vector<std::uint8_t> flags;
  std::vector<double> told;
  std::vector<double> looked_m;
  std::vector<double> began_m;
  std::vector<model::Utime> began;
  std::string points;
  for (const auto& [id, tracked] : points_) {
    ids.push_back(id);
    flags.push_back(static_cast<std::uint8_t>(
        (tracked.is_in_use ? 1 : 0) | (tracked.was_told_in_use ? 2 : 0) |
        (tracked.state_is_due ? 4 : 0) | (tracked.is_first_pass ? 8 : 0) |
        (tracked.is_counted ? 16 : 0) | (tracked.has_just_left ? 32 : 0) |
        (lessons_.is_judged(tracked) ? 64 : 0) | (tracked.is_among_histories ? 128 : 0)));
    told.push_back(tracked.told_probability);
    looked_m.push_back(tracked.looked_m);
    began_m.push_back(tracked.pass_began_m);
    began.push_back(tracked.pass_began_utime);
    points += encode(tracked);
  }
  return state::save(kFormat, learned, ids, flags, told, looked_m, began_m, began, points, places_,
                     need_, path_, lessons_, use_, news_, births_, looks_, last_, wants_map_);
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
              loaded.places_, loaded.need_, loaded.path_, loaded.lessons_, loaded.use_,
              loaded.news_, loaded.births_, loaded.looks_, loaded.last_, loaded.wants_map_);
  if (flags.size() != ids.size() || told.size() != ids.size() || looked_m.size() != ids.size() ||
      began_m.size() != ids.size() || began.size() != ids.size() ||
      points.size() != ids.size() * point_bytes())
    throw std::invalid_argument("existence tracker state: its points do not fit their numbers");

  loaded.lessons_.begin_anew();
  loaded.lessons_.take(learned);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const std::string_view bytes =
        std::string_view(points).substr(i * point_bytes(), point_bytes());
    TrackedPoint tracked = decode(loaded.lessons_.model(), bytes, (flags[i] & 1U) != 0);
    tracked.was_told_in_use = (flags[i] & 2U) != 0;
    tracked.state_is_due = (flags[i] & 4U) != 0;
    tracked.is_first_pass = (flags[i] & 8U) != 0;
    tracked.is_counted = (flags[i] & 16U) != 0;
    tracked.has_just_left = (flags[i] & 32U) != 0;
    tracked.is_among_histories = (flags[i] & 128U) != 0;
    loaded.lessons_.restore(ids[i], tracked, (flags[i] & 64U) != 0);
    if (tracked.state_is_due) loaded.news_.begin(ids[i]);
    tracked.told_probability = told[i];
    tracked.looked_m = looked_m[i];
    tracked.pass_began_m = began_m[i];
    tracked.pass_began_utime = began[i];
    loaded.use_.add(tracked);
    loaded.points_.emplace(ids[i], tracked);
  }
  *this = std::move(loaded);
}

}  // namespace understory::existence_tracker
