// Drives that miss most of what stands.
#include <memory>

#include "services/existence_tracker/existence_tracker.hpp"
#include "tests/catch.hpp"
#include "tests/existence_tracker/past_landmarks.hpp"

using namespace understory;
using existence_tracker::ExistenceTracker;
using existence_tracker::TrackerParameters;
using test::Road;

namespace {

constexpr model::Utime kDay_us = 86'400'000'000;
constexpr model::Utime kYear_us = 365 * kDay_us;

/// Trees: some 2.5 % go in a year, and that is known from elsewhere.
TrackerParameters for_trees() {
  TrackerParameters parameters;
  parameters.model.range_m = Road::kRangeM;
  parameters.model.decay_per_s = 8e-10;
  parameters.model.decay_weight = 20.0;
  return parameters;
}

/// Another drive: the tracker begins with what it knew.
std::unique_ptr<ExistenceTracker> next_drive(ExistenceTracker& tracker, const Road& road) {
  auto next = std::make_unique<ExistenceTracker>(for_trees());
  next->begin_with(tracker.take_states());
  next->on_map(road.map());
  return next;
}

std::size_t count_unused(const Road& road, const ExistenceTracker& tracker) {
  std::size_t unused = 0;
  for (model::LandmarkId id = 1; id <= road.size(); ++id) {
    const auto one = tracker.of(id);
    unused += one && !one->is_in_use ? 1 : 0;
  }
  return unused;
}

}  // namespace

TEST_CASE("Drives that miss two thirds of the landmarks take none out of use", "[existence]") {
  for (const std::uint64_t seed : {31, 32, 33}) {
    Road road(seed);
    auto tracker = std::make_unique<ExistenceTracker>(for_trees());
    tracker->on_map(road.map());
    for (const model::MapUpdate& update : road.drive(0, [](model::LandmarkId) { return true; }))
      tracker->on_update(update);

    for (int day = 1; day <= 4; ++day) {
      tracker = next_drive(*tracker, road);
      const auto missed = road.draw(0.66);
      const auto is_seen = [&](model::LandmarkId id) { return !missed.contains(id); };
      for (const model::MapUpdate& update : road.drive(6 * kYear_us + day * kDay_us, is_seen))
        tracker->on_update(update);
      CAPTURE(seed, day);
      CHECK(count_unused(road, *tracker) == 0);
    }
  }
}
