#include <malloc.h>

#include "common/story/story_book.hpp"
#include "tests/catch.hpp"
#include "tests/story/random_drive.hpp"

using namespace understory;
using namespace understory::test;
using Catch::Matchers::Contains;

namespace {

std::size_t heap_bytes() {
  const auto info = ::mallinfo2();
  return info.uordblks + info.hblkhd;
}

std::string all_facts(const story::Story& story) {
  std::string text;
  for (const auto& [name, value] : story.facts) text += name + ": " + value + "\n";
  return text;
}

/// Every landmark of a map seen, missed and judged by this many keyframes, 500 at a time.
void drive_over(story::StoryBook& book, std::uint64_t landmarks, int rounds) {
  constexpr std::uint64_t kInView = 500;
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kUpdated;
  for (std::uint64_t from = 1; from <= landmarks; from += kInView) {
    for (int round = 0; round < rounds; ++round) {
      update.utime += 1'000'000;
      ++update.keyframe_sequence;
      update.added.clear();
      update.associations.clear();
      update.expected.clear();
      auto existence = stamped<model::Existence>(update.utime);
      for (std::uint64_t i = from; i < from + kInView; ++i) {
        if (round == 0) update.added.push_back(id_of(1, i));
        if (round % 2 == 0) update.associations.push_back({0, id_of(1, i)});
        if (round % 2 == 1) update.expected.push_back({id_of(1, i)});
        existence.landmarks.push_back({id_of(1, i), 0.5, round % 3 != 0});
      }
      book.take(update, update.utime);
      book.take(existence, update.utime);
    }
  }
}

}  // namespace

TEST_CASE("a hundred thousand landmarks and days of messages stay within the limit", "[story]") {
  const std::size_t before = heap_bytes();
  story::StoryBook book;
  drive_over(book, 100'000, 40);
  model::SlamPose pose;
  model::Odometry motion;
  model::Keyframe keyframe;
  keyframe.members.resize(100);
  for (model::Utime i = 0; i < 50'000; ++i) {
    pose.utime = motion.utime = keyframe.utime = 100'000 * i;
    book.take(pose, pose.utime);
    book.take(motion, pose.utime);
    book.take(stamped<model::LandmarkScan>(pose.utime), pose.utime);
    book.take(stamped<model::TrackedScan>(pose.utime), pose.utime);
    book.take(stamped<model::EkfPose>(pose.utime), pose.utime);
    book.take(stamped<model::PlanarScan>(pose.utime), true, pose.utime);
    book.take(stamped<model::PlanarScan>(pose.utime), false, pose.utime);
    book.take(stamped<model::PointSweep>(pose.utime), true, pose.utime);
    book.take(stamped<model::PointSweep>(pose.utime), false, pose.utime);
    book.take(keyframe, pose.utime);
  }

  CHECK(book.landmarks().records().all().size() == 100'000);
  CHECK(book.landmarks().records().forgotten() == 0);
  CHECK(book.bytes() <= story::Limits{}.bytes);
  CHECK(heap_bytes() - before <= story::Limits{}.bytes);

  // The first ones keep the newest of what happened, and say what they lost; the last ones have
  // all.
  const auto* old = book.landmarks().find(id_of(1, 1));
  CHECK(old->looks.dropped() > 0);
  CHECK(old->seen == 20);
  CHECK_THAT(all_facts(book.landmark(id_of(1, 1)).story.value()),
             Contains("earlier keyframes were dropped: ") && Contains("by 20 keyframes"));
  CHECK(book.landmarks().find(id_of(1, 100'000))->looks.size() == 40);
  CHECK_THAT(all_facts(book.pose({story::PoseQuestion::Choice::kLast, 0}).story.value()),
             Contains("earlier poses were dropped: 44000"));
}

TEST_CASE("where there is no place the landmark that was not spoken of for longest goes",
          "[story]") {
  story::Limits limits;
  limits.landmarks = 100;
  story::StoryBook book(limits);
  model::MapUpdate update;
  update.status = model::MapUpdateStatus::kUpdated;
  for (std::uint64_t i = 1; i <= 150; ++i) {
    update.utime = static_cast<model::Utime>(i);
    update.associations = {{0, id_of(1, i)}, {1, id_of(1, 1)}};
    book.take(update, 0);
  }
  CHECK(book.landmarks().records().all().size() == 100);
  CHECK(book.landmarks().records().forgotten() == 50);
  for (std::uint64_t i = 1; i <= 150; ++i) {
    CAPTURE(i);
    CHECK((book.landmarks().find(id_of(1, i)) != nullptr) == (i == 1 || i > 51));
  }
  CHECK_THAT(book.landmark(id_of(1, 2)).error, Contains("50 more were forgotten"));
}

TEST_CASE("random drives within small limits tell what they still know", "[story]") {
  story::Limits limits;
  limits.bytes = 200'000;
  limits.landmarks = 60;
  limits.moments = 50;
  limits.submaps = 1;
  limits.poses = limits.keyframes = limits.odometry = 10;
  limits.looks = 16;
  limits.probabilities = 8;
  limits.events = 2;
  for (const std::uint64_t seed : {1U, 2U}) {
    RandomDrive drive(seed);
    story::StoryBook book(limits);
    NaiveReader naive;
    for (int k = 0; k < 400; ++k) {
      const Said said = drive.next();
      book.take(said.update, 0);
      book.take(said.delta, 0);
      book.take(said.existence, 0);
      naive.take(said.update);
    }

    CHECK(book.bytes() <= limits.bytes);
    CHECK(book.landmarks().records().forgotten() > 0);
    for (const auto& record : book.landmarks().records().all()) {
      CAPTURE(seed, record.id);
      const Noted& noted = naive.notes().at(record.id);
      CHECK(record.seen <= noted.seen.size());
      CHECK(record.looks.size() + record.looks.dropped() == record.seen + record.missed);
      CHECK(book.landmark(record.id).story);
    }
  }
}

TEST_CASE("a ring keeps the newest values through growth and trimming", "[story]") {
  std::mt19937_64 random(5);
  story::Budget budget(1000);
  story::Ring<std::uint32_t> ring;
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < 500; ++i) {
    ring.push(i, 64, budget);
    all.push_back(i);
    if (std::bernoulli_distribution(0.02)(random)) ring.trim(budget);
    REQUIRE(ring.size() + ring.dropped() == all.size());
    for (std::uint32_t k = 0; k < ring.size(); ++k)
      REQUIRE(ring[k] == all[all.size() - ring.size() + k]);
  }
  ring.clear(budget);
  CHECK(budget.used() == 0);
  CHECK(ring.size() == 0);
}
