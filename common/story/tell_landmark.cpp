#include <fmt/format.h>

#include <map>
#include <set>

#include "common/story/tell.hpp"
#include "common/story/words.hpp"

namespace understory::story {
namespace {

/// Makes the text on one landmark.
class LandmarkTeller {
 public:
  LandmarkTeller(const LandmarkBook& book, const LandmarkRecord& record, model::Utime start)
      : book_(book), record_(record), start_(start) {}

  void facts(Story& story) const {
    add(story, "state", state());
    if (record_.has_position) {
      add(story, "position", position());
      add(story, "moved", moved());
      add(story, "kind", kind());
    }
    add(story, "born", born());
    add(story, "first seen", first_seen());
    add(story, "seen", seen());
    add(story, "not seen", missed());
    add(story, "probability", probability());
    add(story, "took up", taken_up());
    add(story, "limits", dropped());
  }

  /// Adds events in order of time, each with `prefix`.
  void events(Story& story, const std::string& prefix) const {
    std::vector<StoryEvent> all;
    std::vector<StoryEvent> later = looks();
    for (std::uint32_t i = 0; i < record_.events.size(); ++i) {
      const LandmarkEvent& one = record_.events[i];
      // At one stamp, begins come before looks, and looks before ends.
      const bool begins = one.kind == EventKind::kBorn || one.kind == EventKind::kTold;
      (begins ? all : later).push_back({stamp(one.moment), words(one)});
    }
    all.insert(all.end(), later.begin(), later.end());
    std::ranges::stable_sort(all, {}, &StoryEvent::utime);
    for (StoryEvent& one : all) story.events.push_back({one.utime, prefix + one.text});
  }

  void series(Story& story) const {
    if (record_.probabilities.size() == 0) return;
    StorySeries series{"probability that " + landmark_name(record_.id) + " exists", "", {}, {}};
    for (std::uint32_t i = 0; i < record_.probabilities.size(); ++i) {
      const ProbabilityPoint& one = record_.probabilities[i];
      const Moment* const moment = book_.moment(one.moment);
      if (moment == nullptr) continue;
      series.t.push_back(moment->utime);
      series.v.push_back(std::round(1e6 * static_cast<double>(one.probability)) * 1e-6);
    }
    story.series.push_back(std::move(series));
  }

  void seen_from(Story& story) const {
    for (std::uint32_t i = 0; i < record_.looks.size(); ++i) {
      const Moment* const moment = book_.moment(record_.looks[i].moment);
      if (record_.looks[i].is_seen == 1 && moment != nullptr)
        story.seen_from.push_back(moment->vehicle_m);
    }
  }

 private:
  static void add(Story& story, const char* name, std::string text) {
    if (!text.empty()) story.facts.emplace_back(name, std::move(text));
  }
  std::string at(model::Utime utime) const { return "at " + when(utime, start_); }
  model::Utime stamp(MomentNumber number) const {
    const Moment* const moment = book_.moment(number);
    return moment == nullptr ? start_ : moment->utime;
  }
  /// "at ..., keyframe 12", as far as it is still known.
  std::string moment_words(MomentNumber number) const {
    const Moment* const moment = book_.moment(number);
    if (moment == nullptr) return "at a time that was dropped";
    if (!moment->has_keyframe()) return at(moment->utime);
    return fmt::format("by keyframe {} {}", moment->keyframe, at(moment->utime));
  }

  std::string state() const {
    std::string text = "in the map";
    if (record_.fate == Fate::kRemoved) text = "removed " + moment_words(record_.end);
    if (record_.fate == Fate::kMerged) {
      text = fmt::format("merged into {} {}", landmark_name_and_id(record_.survivor),
                         moment_words(record_.end));
    }
    if (record_.submap != 0) {
      text = fmt::format("kept by the store, in submap {}", record_.submap);
    }
    if (book_.is_left_out(record_)) text = "not in the last whole MAP, though nothing removed it";
    if (!record_.has_position && record_.fate == Fate::kThere) {
      text = "named by messages; no MAP or MAP_DELTA tells where it is";
    }

    const std::uint32_t map = book_.map_in_use();
    if (map != 0 && map != model::map_of(record_.id)) {
      text += fmt::format("; the map in use is {}", map);
    }
    return text + (record_.is_in_use ? "" : "; out of use: taken for gone");
  }

  std::string position() const {
    Eigen::Matrix2d covariance;
    covariance << record_.cxx_m2, record_.cxy_m2, record_.cxy_m2, record_.cyy_m2;
    return place_words(book_.position_m(record_)) + ", " + sigma_words(covariance) +
           (record_.submap != 0 ? " within its submap" : "") + ", frame map";
  }

  std::string moved() const {
    std::string text =
        fmt::format("{:.3f} m since {}", (book_.position_m(record_) - record_.first_m).norm(),
                    when(record_.told_utime, start_));
    if (record_.moves > 0) text += fmt::format(", told {}", counted(record_.moves, "time"));
    if (record_.largest_move_m > 0.0F) {
      text += fmt::format(", at most {:.3f} m at once, {}", record_.largest_move_m,
                          moment_words(record_.largest_move));
    }
    return text;
  }

  std::string kind() const {
    std::string text = record_.is_corner ? "corner" : "trunk";
    if (record_.radius_m > 0.0F) text += fmt::format(", radius {:.3f} m", record_.radius_m);
    return text + fmt::format(", detected in {} as the map counts",
                              counted(record_.observation_count, "scan"));
  }

  std::string born_by(const Moment* keyframe) const {
    if (keyframe == nullptr) return "by a keyframe that was dropped";
    return fmt::format("by keyframe {} ({}) {}, with the vehicle at {}", keyframe->keyframe,
                       status_words(keyframe->status), at(keyframe->utime),
                       place_words(keyframe->vehicle_m));
  }
  std::string born() const {
    switch (record_.origin) {
      case Origin::kByKeyframe:
        return born_by(book_.moment(record_.birth));
      case Origin::kByMap:
        return "before these messages, or given: MAP has it " + at(record_.told_utime);
      case Origin::kByMapChange:
        return "not told by any SLAM_UPDATE; MAP_DELTA has it " + at(record_.told_utime);
      case Origin::kNotTold:
        break;
    }
    return "before these messages: nothing tells of it";
  }

  std::string first_seen() const {
    if (record_.seen == 0) return "never: no placed keyframe was associated with it";
    const Sight& sight = record_.first_seen;
    std::string text = fmt::format("by keyframe {} {}, from {}", sight.keyframe, at(sight.utime),
                                   place_words(sight.vehicle_m));
    if (record_.has_position)
      text += fmt::format(", {:.1f} m away", (sight.vehicle_m - record_.first_m).norm());
    return text;
  }

  std::string seen() const {
    if (record_.seen == 0) return "";
    std::string text = fmt::format("by {}, the last {}", counted(record_.seen, "keyframe"),
                                   moment_words(record_.last_seen));
    if (record_.gaps > 0) {
      text += fmt::format("; {}, the longest of {}", counted(record_.gaps, "gap"),
                          counted(record_.longest_gap, "keyframe"));
    }
    return text;
  }

  std::string missed() const {
    if (record_.missed == 0) return "";
    return fmt::format("though expected, by {}, the last {}", counted(record_.missed, "keyframe"),
                       moment_words(record_.last_missed));
  }

  std::string probability() const {
    if (record_.probabilities.size() == 0) return "";
    const std::uint64_t values = record_.probabilities.size() + record_.probabilities.dropped();
    return fmt::format("{:.4f} {}; least {:.4f}; {}", record_.probabilities.back().probability,
                       at(stamp(record_.probabilities.back().moment)), record_.least_probability,
                       counted(values, "value"));
  }

  std::string taken_up() const {
    std::string text;
    for (std::uint32_t i = 0; i < record_.events.size(); ++i) {
      const LandmarkEvent& one = record_.events[i];
      if (one.kind != EventKind::kTookUp) continue;
      text += (text.empty() ? "" : ", ") + landmark_name_and_id(one.other);
    }
    return text;
  }

  std::string dropped() const {
    std::string text;
    for (const std::string& one :
         {dropped_words("events", record_.events.dropped()),
          dropped_words("keyframes", record_.looks.dropped()),
          dropped_words("probabilities", record_.probabilities.dropped())}) {
      if (!one.empty()) text += (text.empty() ? "" : "; ") + one;
    }
    return text;
  }

  std::string words(const LandmarkEvent& event) const {
    const Moment* const moment = book_.moment(event.moment);
    const std::string by = moment != nullptr && moment->has_keyframe()
                               ? fmt::format(" by keyframe {}", moment->keyframe)
                               : "";
    switch (event.kind) {
      case EventKind::kBorn:
        return "born" + by;
      case EventKind::kJoined:
        return "its map became part of the map in use" + by;
      case EventKind::kBornAgain:
        return "born" + by + " of a mapper that began anew: the id was another landmark's before";
      case EventKind::kTold:
        return "in the map";
      case EventKind::kMerged:
        return "merged into " + landmark_name_and_id(event.other) + by;
      case EventKind::kTookUp:
        return "took up " + landmark_name_and_id(event.other) + by;
      case EventKind::kRemoved:
        return "removed" + by;
      case EventKind::kReturned:
        return "in the map again";
      case EventKind::kUnused:
        return "out of use: taken for gone";
      case EventKind::kUsed:
        return "in use again";
      case EventKind::kHandedOver:
        return fmt::format("handed over to the store with submap {}", event.other);
      case EventKind::kCameBack:
        return "back from the store";
    }
    return "";
  }

  /// Runs of successive keyframes that saw it, or that missed it.
  std::vector<StoryEvent> looks() const {
    std::vector<StoryEvent> all;
    std::uint32_t begin = 0;
    for (std::uint32_t i = 1; i <= record_.looks.size(); ++i) {
      if (i < record_.looks.size() && goes_on(record_.looks[i - 1], record_.looks[i])) continue;
      all.push_back(stretch(begin, i - 1));
      begin = i;
    }
    return all;
  }
  bool goes_on(const Look& before, const Look& now) const {
    const Moment* const from = book_.moment(before.moment);
    const Moment* const to = book_.moment(now.moment);
    if (from == nullptr || to == nullptr) return from == to;
    return before.is_seen == now.is_seen && to->placed == from->placed + 1;
  }
  StoryEvent stretch(std::uint32_t first, std::uint32_t last) const {
    const char* const what = record_.looks[first].is_seen == 1 ? "seen" : "expected and not seen";
    const Moment* const from = book_.moment(record_.looks[first].moment);
    const Moment* const to = book_.moment(record_.looks[last].moment);
    if (from == nullptr || to == nullptr)
      return {start_, fmt::format("{} by {} that were dropped", counted(last - first + 1, "look"),
                                  "keyframes")};
    if (first == last) return {from->utime, fmt::format("{} by keyframe {}", what, from->keyframe)};
    return {from->utime, fmt::format("{} by keyframes {} to {}, until {}", what, from->keyframe,
                                     to->keyframe, when(to->utime, start_))};
  }

  const LandmarkBook& book_;
  const LandmarkRecord& record_;
  model::Utime start_;
};

/// The known ids, for a question about an unknown one.
std::string known_ids(const LandmarkBook& book, model::LandmarkId wanted) {
  struct Ids {
    std::uint64_t count = 0;
    model::LandmarkId first = ~std::uint64_t{0};
    model::LandmarkId last = 0;
    model::LandmarkId nearest = 0;
  };
  constexpr unsigned kBits = model::kLandmarkCounterBits;
  const auto distance = [&](model::LandmarkId id) {
    return id < wanted ? wanted - id : id - wanted;
  };
  std::map<std::uint32_t, Ids> maps;
  for (const LandmarkRecord& one : book.records().all()) {
    Ids& ids = maps[model::map_of(one.id)];
    if (ids.count++ == 0 || distance(one.id) < distance(ids.nearest)) ids.nearest = one.id;
    ids.first = std::min(ids.first, one.id);
    ids.last = std::max(ids.last, one.id);
  }

  if (maps.empty()) return "none has any: no SLAM_UPDATE, MAP, MAP_DELTA or EXISTENCE names one";
  std::string text = "known are";
  for (const auto& [map, ids] : maps) {
    text += fmt::format("{} map {}: {}, {} to {}", map == maps.begin()->first ? "" : ";", map,
                        counted(ids.count, "landmark"), landmark_name_and_id(ids.first),
                        landmark_name_and_id(ids.last));
    if (map == model::map_of(wanted)) text += ", nearest " + landmark_name_and_id(ids.nearest);
    const model::LandmarkId perhaps = (ids.first >> kBits << kBits) | wanted;
    if (model::map_of(wanted) == 0 && map != 0 && book.find(perhaps) != nullptr)
      text += ", perhaps " + landmark_name_and_id(perhaps);
  }
  return text;
}

}  // namespace

Answer tell_landmark(const LandmarkBook& book, model::LandmarkId id, model::Utime start) {
  const LandmarkRecord* record = book.find(id);
  if (record == nullptr) {
    std::string error = fmt::format("landmark {}: no message names it; {}",
                                    landmark_name_and_id(id), known_ids(book, id));
    if (book.records().forgotten() > 0) {
      error += fmt::format("; {} more were forgotten", book.records().forgotten());
    }
    return {std::nullopt, error};
  }

  Story story;
  story.title = "landmark " + landmark_name_and_id(id);
  LandmarkTeller(book, *record, start).facts(story);
  std::string prefix;
  std::set<model::LandmarkId> told;
  while (record != nullptr && told.insert(record->id).second) {
    const LandmarkTeller teller(book, *record, start);
    teller.events(story, prefix);
    teller.series(story);
    teller.seen_from(story);
    if (record->fate != Fate::kMerged) break;
    record = book.find(record->survivor);
    if (record != nullptr) prefix = landmark_name(record->id) + ": ";
  }

  if (told.size() > 1 && record != nullptr) {
    Story survivor;
    LandmarkTeller(book, *record, start).facts(survivor);
    for (auto& [name, value] : survivor.facts)
      story.facts.emplace_back("lives on as " + landmark_name(record->id) + ": " + name,
                               std::move(value));
  }
  std::ranges::stable_sort(story.events, {}, &StoryEvent::utime);
  return {std::move(story), ""};
}

}  // namespace understory::story
