// What the last metres of path show of the map: shares by hand.
#include "services/existence_tracker/mapping_need.hpp"
#include "tests/catch.hpp"

using namespace understory;
using existence_tracker::MappingNeed;

namespace {

/// `count` landmarks from `first` on, each looked for three times.
void look_for(MappingNeed& need, model::LandmarkId first, int count, bool is_hit,
              double probability, double along_m = 0.0) {
  for (int i = 0; i < count; ++i)
    for (int look = 0; look < 3; ++look)
      need.look_for(first + static_cast<model::LandmarkId>(i), is_hit, probability, along_m);
}

void see_new(MappingNeed& need, model::LandmarkId first, int count, double probability,
             double along_m = 0.0) {
  for (int i = 0; i < count; ++i)
    need.look_at_new(first + static_cast<model::LandmarkId>(i), true, probability, along_m);
}

}  // namespace

TEST_CASE("Shares of what is missing and of what is new", "[existence]") {
  MappingNeed need;
  look_for(need, 1, 30, true, 0.99);
  look_for(need, 101, 10, false, 0.99);
  CHECK(need.missing_share(1.0) == Approx(0.25));
  CHECK(need.missing_share(0.75) == Approx(0.0));  // No more than the detector misses.
  CHECK(need.new_share() == 0.0);

  see_new(need, 201, 10, 1.0);
  CHECK(need.new_share() == Approx(0.25));
  CHECK(need.missing_share(1.0) == Approx(0.25));

  need.drive_to(61.0);
  CHECK(need.missing_share(1.0) == 0.0);
  CHECK(need.new_share() == 0.0);
}

TEST_CASE("A map of earlier passes can have changed, a first drive asks for nothing",
          "[existence]") {
  MappingNeed need;
  see_new(need, 201, 60, 1.0);
  CHECK(need.new_share() == 1.0);
  CHECK_FALSE(need.is_needed(1.0));

  // With the tenth landmark of an earlier pass there is a map; what was new before it is of that.
  need.know(9);
  see_new(need, 201, 60, 1.0);
  CHECK_FALSE(need.is_needed(1.0));
  need.know(1);
  CHECK_FALSE(need.is_needed(1.0));
  see_new(need, 201, 60, 1.0);
  CHECK(need.is_needed(1.0));
  need.know(1);
  CHECK(need.is_needed(1.0));
  look_for(need, 1, 300, true, 0.99);
  CHECK_FALSE(need.is_needed(1.0));
}

TEST_CASE("What may be false is as little missing and new as it is probable", "[existence]") {
  MappingNeed need;
  look_for(need, 1, 30, true, 0.9);
  look_for(need, 101, 30, false, 0.1);
  CHECK(need.missing_share(1.0) == Approx(0.1));

  see_new(need, 201, 60, 0.05);
  see_new(need, 301, 60, 0.0);  // Not used yet.
  CHECK(need.new_share() == Approx(3.0 / 33.0));
}

TEST_CASE("New ones are followed while they are in view, and stay new", "[existence]") {
  MappingNeed need;
  look_for(need, 1, 10, true, 1.0);
  see_new(need, 101, 10, 0.5);
  see_new(need, 101, 10, 1.0, 5.0);
  CHECK(need.new_share() == Approx(0.5));
  for (model::LandmarkId id = 101; id < 111; ++id) need.look_at_new(id, false, 0.1, 10.0);
  CHECK(need.new_share() == Approx(1.0 / 11.0));
  look_for(need, 101, 10, true, 1.0, 15.0);
  CHECK(need.new_share() == Approx(1.0 / 11.0));

  // A miss alone makes none.
  need.look_at_new(999, false, 1.0, 15.0);
  CHECK(need.new_share() == Approx(1.0 / 11.0));
}

TEST_CASE("Of few landmarks nothing is said", "[existence]") {
  MappingNeed need;
  look_for(need, 1, 9, false, 1.0);
  see_new(need, 101, 9, 1.0);
  CHECK(need.missing_share(1.0) == 0.0);
  CHECK(need.new_share() == 0.0);
  need.look_for(10, false, 1.0, 0.0);  // Looked for once only.
  CHECK(need.missing_share(1.0) == 0.0);
}
