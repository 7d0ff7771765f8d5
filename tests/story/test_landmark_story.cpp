#include <algorithm>

#include "common/story/story_book.hpp"
#include "tests/catch.hpp"
#include "tests/story/random_drive.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;
using story::EventKind;
using story::StoryBook;

namespace {

/// The value of a fact; empty where there is none.
std::string fact(const story::Story& story, const std::string& name) {
  for (const auto& [known, value] : story.facts)
    if (known == name) return value;
  return {};
}

bool tells(const story::Story& story, const std::string& text) {
  return std::ranges::any_of(story.events, [&](const story::StoryEvent& one) {
    return one.text.find(text) != std::string::npos;
  });
}

/// Numbers of the keyframes of all events of this kind.
std::vector<std::uint64_t> keyframes_of(const StoryBook& book, const story::LandmarkRecord& record,
                                        EventKind kind) {
  std::vector<std::uint64_t> keyframes;
  for (std::uint32_t i = 0; i < record.events.size(); ++i) {
    const auto& event = record.events[i];
    if (event.kind == kind) keyframes.push_back(book.landmarks().moment(event.moment)->keyframe);
  }
  return keyframes;
}

void check_looks(const StoryBook& book, const story::LandmarkRecord& record, const Noted& noted) {
  std::vector<std::uint64_t> seen;
  std::vector<std::uint64_t> missed;
  for (std::uint32_t i = 0; i < record.looks.size(); ++i) {
    const auto* moment = book.landmarks().moment(record.looks[i].moment);
    (record.looks[i].is_seen == 1 ? seen : missed).push_back(moment->keyframe);
  }
  CHECK(seen == noted.seen);
  CHECK(missed == noted.missed);
  CHECK(record.seen == noted.seen.size());
  CHECK(record.missed == noted.missed.size());
  if (!noted.seen.empty()) {
    CHECK(record.first_seen.keyframe == noted.seen.front());
    CHECK(book.landmarks().moment(record.last_seen)->keyframe == noted.seen.back());
  }
}

void check_series(const StoryBook& book, model::LandmarkId id, const Noted& noted) {
  const auto answer = book.landmark(id);
  REQUIRE(answer.story);
  if (noted.probabilities.empty()) return;
  const auto& series = answer.story->series.at(0);
  REQUIRE(series.t.size() == noted.probabilities.size());
  for (std::size_t i = 0; i < series.t.size(); ++i) {
    CHECK(series.t[i] == noted.probabilities[i].first);
    CHECK(series.v[i] == Approx(noted.probabilities[i].second).margin(1e-6));
  }
}

}  // namespace

TEST_CASE("what is told of each landmark is what a reader of everything notes", "[story]") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    RandomDrive drive(seed);
    StoryBook book(story::Limits::of_a_log());
    NaiveReader naive;
    for (int k = 0; k < 200; ++k) {
      const Said said = drive.next();
      book.take(said.update, 0);
      book.take(said.delta, 0);
      book.take(said.existence, 0);
      naive.take(said.update);
      naive.take(said.delta);
      naive.take(said.existence);
    }

    CHECK(naive.notes().size() == drive.given());
    for (const auto& [id, noted] : naive.notes()) {
      CAPTURE(seed, id);
      const story::LandmarkRecord* record = book.landmarks().find(id);
      REQUIRE(record != nullptr);
      check_looks(book, *record, noted);
      check_series(book, id, noted);

      const auto [gaps, longest] = naive.gaps_and_longest(noted);
      CHECK(record->gaps == gaps);
      CHECK(record->longest_gap == longest);
      CHECK(keyframes_of(book, *record, EventKind::kBorn) == noted.born);
      CHECK(keyframes_of(book, *record, EventKind::kRemoved) == noted.removed);
      CHECK(keyframes_of(book, *record, EventKind::kMerged).size() == noted.merged.size());
      CHECK(keyframes_of(book, *record, EventKind::kTookUp).size() == noted.took_up.size());
      if (!noted.merged.empty()) CHECK(record->survivor == noted.merged.back().second);
      if (!noted.told.empty()) {
        CHECK((record->first_m - noted.told.front()).norm() < 1e-12);
        CHECK((book.landmarks().position_m(*record) - noted.told.back()).norm() < 1e-12);
      }
      if (!noted.in_use.empty()) CHECK(record->is_in_use == noted.in_use.back());
    }
  }
}

TEST_CASE("a story is told in order of time and names what happened", "[story]") {
  StoryBook book;
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kFirstMap;
  update.utime = 10'000'000;
  update.keyframe_sequence = 7;
  update.map_T_vehicle = {3.0, 4.0, 0.0};
  update.added = {id_of(1, 1), id_of(1, 2)};
  update.associations = {{0, id_of(1, 1)}, {1, id_of(1, 2)}};
  book.take(update, 0);
  model::MapDelta delta;
  delta.utime = update.utime;
  model::MapLandmark one;
  one.id = id_of(1, 1);
  one.covariance_m2 = Eigen::Vector2d(0.04, 0.01).asDiagonal();
  one.radius_m = 0.2;
  delta.added = {one};
  book.take(delta, 0);

  update.status = model::MapUpdateStatus::kUpdated;
  update.utime = 12'500'000;
  update.keyframe_sequence = 8;
  update.added.clear();
  update.associations = {{0, id_of(1, 2)}};
  update.expected = {{id_of(1, 1)}};
  book.take(update, 0);
  auto existence = stamped<model::Existence>(update.utime);
  existence.landmarks = {{id_of(1, 1), 0.1, false}};
  book.take(existence, 0);

  const auto story = book.landmark(id_of(1, 1)).story.value();
  CHECK(story.title == "landmark 1:1 (281474976710657)");
  CHECK(fact(story, "state") == "in the map; out of use: taken for gone");
  CHECK_THAT(fact(story, "position"), Contains("sigma 0.200 m and 0.100 m"));
  CHECK_THAT(fact(story, "kind"), Contains("trunk, radius 0.200 m"));
  CHECK_THAT(fact(story, "born"), Contains("by keyframe 7 (first of its map) at 0.000 s"));
  CHECK_THAT(fact(story, "first seen"), Contains("x 3.00 m, y 4.00 m, 5.0 m away"));
  CHECK_THAT(fact(story, "seen"), Contains("by 1 keyframe,"));
  CHECK_THAT(fact(story, "not seen"), Contains("the last by keyframe 8 at 2.500 s"));
  CHECK_THAT(fact(story, "probability"), Contains("0.1000"));
  CHECK(fact(story, "limits").empty());

  CHECK(story.events.front().text == "born by keyframe 7");
  CHECK(tells(story, "expected and not seen by keyframe 8"));
  CHECK(tells(story, "out of use: taken for gone"));
  CHECK(std::ranges::is_sorted(story.events, {}, &story::StoryEvent::utime));
  REQUIRE(story.seen_from.size() == 1);
  CHECK(story.seen_from[0] == Eigen::Vector2d(3.0, 4.0));
}

TEST_CASE("the story of a merged landmark goes on with the one that lives on", "[story]") {
  StoryBook book;
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kFirstMap;
  update.utime = 1'000'000;
  update.added = {id_of(1, 1), id_of(1, 2), id_of(1, 3)};
  book.take(update, 0);
  update.status = model::MapUpdateStatus::kUpdated;
  update.added.clear();
  for (const auto& merge : {std::pair(id_of(1, 1), id_of(1, 2)), {id_of(1, 2), id_of(1, 3)}}) {
    update.utime += 1'000'000;
    ++update.keyframe_sequence;
    update.merged = {merge};
    book.take(update, 0);
  }

  const auto first = book.landmark(id_of(1, 1)).story.value();
  CHECK_THAT(fact(first, "state"), Contains("merged into 1:2") && Contains("by keyframe 1"));
  CHECK_FALSE(fact(first, "lives on as 1:3: state").empty());
  CHECK(tells(first, "1:3: took up 1:2"));
  const auto last = book.landmark(id_of(1, 3)).story.value();
  CHECK_THAT(fact(last, "took up"), Contains("1:2"));

  // Ids that were merged in a circle (by nobody who is right) still have an end.
  update.merged = {{id_of(1, 3), id_of(1, 1)}};
  book.take(update, 0);
  CHECK(book.landmark(id_of(1, 1)).story);
}

TEST_CASE("submaps take landmarks away, move them and bring them back", "[story]") {
  StoryBook book;
  model::Submap submap;
  submap.id = 4;
  submap.utime = 1'000'000;
  submap.map_T_submap = {10.0, 0.0, 0.0};
  model::MapLandmark one;
  one.id = id_of(1, 1);
  one.position_m = {1.0, 2.0};
  submap.landmarks = {one};
  book.take(submap, 0);
  const auto* record = book.landmarks().find(one.id);
  CHECK(book.landmarks().position_m(*record) == Eigen::Vector2d(11.0, 2.0));

  book.take(model::MapCorrection{2'000'000, 0, 1, 1, {{4, {20.0, 0.0, 0.0}}}}, 0);
  CHECK((book.landmarks().position_m(*record) - Eigen::Vector2d(21.0, 2.0)).norm() < 1e-12);
  const auto away = book.landmark(one.id).story.value();
  CHECK_THAT(fact(away, "state"), Contains("in submap 4"));
  CHECK_THAT(fact(away, "position"), Contains("x 21.00 m"));

  one.position_m = {21.5, 2.0};
  model::MapDelta delta;
  delta.utime = 3'000'000;
  delta.added = {one};
  book.take(delta, 0);
  CHECK(book.landmarks().position_m(*record) == one.position_m);
  CHECK(tells(book.landmark(one.id).story.value(), "back from the store"));
}

TEST_CASE("an id that begins anew is another landmark", "[story]") {
  StoryBook book;
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kFirstMap;
  update.utime = 1'000'000;
  update.added = {id_of(1, 1)};
  update.associations = {{0, id_of(1, 1)}};
  for (int run = 0; run < 2; ++run) {
    book.take(update, 0);
    update.utime += 5'000'000;
  }
  const auto story = book.landmark(id_of(1, 1)).story.value();
  CHECK(tells(story, "of a mapper that began anew"));
  CHECK_THAT(fact(story, "first seen"), Contains("5.000 s"));
  CHECK_THAT(fact(story, "seen"), Contains("by 1 keyframe"));
}

TEST_CASE("a landmark that the last MAP leaves out is not said to be there", "[story]") {
  StoryBook book;
  model::WholeMap map;
  map.utime = 1;
  map.landmarks.resize(2);
  map.landmarks[0].id = id_of(1, 1);
  map.landmarks[1].id = id_of(1, 2);
  book.take(map, 0);
  map.landmarks.erase(map.landmarks.begin());
  book.take(map, 0);
  CHECK_THAT(fact(book.landmark(id_of(1, 1)).story.value(), "state"),
             Contains("not in the last whole MAP"));
  CHECK(fact(book.landmark(id_of(1, 2)).story.value(), "state") == "in the map");
  CHECK_THAT(fact(book.landmark(id_of(1, 2)).story.value(), "born"), Contains("or given"));
}

TEST_CASE("an unknown id is answered with those that there are", "[story]") {
  StoryBook book;
  CHECK_THAT(book.landmark(5).error, Contains("no message names it") && Contains("none has any"));
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kFirstMap;
  update.added = {id_of(1, 1), id_of(1, 17), id_of(2, 4)};
  book.take(update, 0);

  const auto answer = book.landmark(id_of(1, 15));
  CHECK_FALSE(answer.story);
  CHECK_THAT(answer.error, Contains("map 1: 2 landmarks, 1:1 (") && Contains("nearest 1:17 (") &&
                               Contains("map 2: 1 landmark, 2:4 ("));
  CHECK_THAT(book.landmark(17).error, Contains("perhaps 1:17 ("));
}
