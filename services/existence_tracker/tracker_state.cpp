// The state of the process, saved whole.
#include <stdexcept>
#include <string_view>
#include <utility>

#include "common/model/archive.hpp"
#include "services/existence_tracker/existence_tracker.hpp"

namespace understory::existence_tracker {
namespace {

constexpr state::Format kFormat{"existence_tracker", 8};

/// All points by their members, one list each, and the states of the points behind one another.
struct SavedPoints {
  std::vector<model::LandmarkId> ids;
  std::vector<std::uint8_t> flags;
  std::vector<double> told;
  std::vector<double> looked_m;
  std::vector<double> began_m;
  std::vector<model::Utime> began;
  std::string points;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.ids, s.flags, s.told, s.looked_m, s.began_m, s.began, s.points);
  }

  void add(model::LandmarkId id, const TrackedPoint& tracked, bool is_judged) {
    ids.push_back(id);
    flags.push_back(
        static_cast<std::uint8_t>((tracked.is_in_use ? 1 : 0) | (tracked.was_told_in_use ? 2 : 0) |
                                  (tracked.state_is_due ? 4 : 0) | (tracked.is_first_pass ? 8 : 0) |
                                  (tracked.is_counted ? 16 : 0) | (tracked.has_just_left ? 32 : 0) |
                                  (is_judged ? 64 : 0) | (tracked.is_among_histories ? 128 : 0)));
    told.push_back(tracked.told_probability);
    looked_m.push_back(tracked.looked_m);
    began_m.push_back(tracked.pass_began_m);
    began.push_back(tracked.pass_began_utime);
    points += encode(tracked);
  }

  /// Throws std::invalid_argument where the lists differ in length.
  void check() const {
    const std::size_t count = ids.size();
    if (flags.size() != count || told.size() != count || looked_m.size() != count ||
        began_m.size() != count || began.size() != count || points.size() != count * point_bytes())
      throw std::invalid_argument("existence tracker state: its points do not fit their numbers");
  }
  bool is_judged(std::size_t i) const { return (flags[i] & 64U) != 0; }
  /// Throws std::invalid_argument.
  TrackedPoint point(std::size_t i, const existence::ExistenceModel& model) const {
    const std::string_view bytes =
        std::string_view(points).substr(i * point_bytes(), point_bytes());
    TrackedPoint tracked = decode(model, bytes, (flags[i] & 1U) != 0);
    tracked.was_told_in_use = (flags[i] & 2U) != 0;
    tracked.state_is_due = (flags[i] & 4U) != 0;
    tracked.is_first_pass = (flags[i] & 8U) != 0;
    tracked.is_counted = (flags[i] & 16U) != 0;
    tracked.has_just_left = (flags[i] & 32U) != 0;
    tracked.is_among_histories = (flags[i] & 128U) != 0;
    tracked.told_probability = told[i];
    tracked.looked_m = looked_m[i];
    tracked.pass_began_m = began_m[i];
    tracked.pass_began_utime = began[i];
    return tracked;
  }
};

}  // namespace

std::string ExistenceTracker::save() const {
  const std::string learned = lessons_.encoded();
  SavedPoints points;
  for (const auto& [id, tracked] : points_) points.add(id, tracked, lessons_.is_judged(tracked));
  return state::save(kFormat, learned, points, places_, need_, path_, lessons_, use_, news_,
                     births_, looks_, last_, wants_map_);
}

void ExistenceTracker::load(const std::string& state) {
  ExistenceTracker loaded(parameters_);
  std::string learned;
  SavedPoints points;
  state::load(state, kFormat, learned, points, loaded.places_, loaded.need_, loaded.path_,
              loaded.lessons_, loaded.use_, loaded.news_, loaded.births_, loaded.looks_,
              loaded.last_, loaded.wants_map_);
  points.check();

  loaded.lessons_.begin_anew();
  loaded.lessons_.take(learned);
  for (std::size_t i = 0; i < points.ids.size(); ++i) {
    const model::LandmarkId id = points.ids[i];
    TrackedPoint tracked = points.point(i, loaded.lessons_.model());
    loaded.lessons_.restore(id, tracked, points.is_judged(i));
    if (tracked.state_is_due) loaded.news_.begin(id);
    loaded.use_.add(tracked);
    loaded.points_.emplace(id, tracked);
  }
  *this = std::move(loaded);
}

}  // namespace understory::existence_tracker
