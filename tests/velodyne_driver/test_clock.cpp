#include <cmath>
#include <cstdlib>
#include <random>

#include "services/velodyne_driver/velodyne_clock.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::velodyne_driver;
using Step = VelodyneClock::Step;

namespace {

constexpr model::Utime kHour_us = 3'600'000'000;

std::uint32_t past_hour(model::Utime utime) { return static_cast<std::uint32_t>(utime % kHour_us); }

}  // namespace

TEST_CASE("stamps go on over the hour, and never change it in between", "[velodyne_driver]") {
  std::mt19937_64 random(3);
  std::uniform_int_distribution<model::Utime> start(1'600'000'000'000'000, 1'900'000'000'000'000);
  std::uniform_int_distribution<model::Utime> delay(100, 3000);
  std::uniform_int_distribution<model::Utime> step(500, 1500);
  for (int run = 0; run < 200; ++run) {
    // Half an hour off is the worst: every packet is as near to one hour as to the other.
    const model::Utime ahead = run % 2 == 0 ? kHour_us / 2 : 0;
    VelodyneClock clock;
    model::Utime time = start(random);
    if (run % 3 == 0) time = time / kHour_us * kHour_us - 500'000;
    std::optional<model::Utime> shift;
    for (int i = 0; i < 1500; ++i) {
      const auto reading = clock.take(past_hour(time + ahead), time + delay(random));
      REQUIRE(reading.step == Step::kNext);
      if (!shift) shift = reading.utime - time;
      REQUIRE(reading.utime - time == *shift);
      time += step(random);
    }
    REQUIRE(std::abs(*shift) <= kHour_us / 2 + 3000);
    REQUIRE((*shift - ahead) % kHour_us == 0);
    // The least delay of many is known to within little.
    REQUIRE(*clock.offset_us() + *shift >= 100);
    REQUIRE(*clock.offset_us() + *shift < 200);
  }
}

TEST_CASE("gaps, disorder and jumps of the sensor's clock are told apart", "[velodyne_driver]") {
  constexpr model::Utime kStart = 1'700'000'000'000'000;
  const auto second_step = [](model::Utime sensor_us, model::Utime computer_us) {
    VelodyneClock clock;
    clock.take(past_hour(kStart), kStart);
    const auto reading = clock.take(past_hour(kStart + sensor_us), kStart + computer_us);
    return std::pair(reading.step, reading.utime - kStart);
  };
  CHECK(second_step(1327, 1300) == std::pair(Step::kNext, model::Utime{1327}));
  CHECK(second_step(1327, 0) == std::pair(Step::kNext, model::Utime{1327}));
  CHECK(second_step(60'000, 60'000) == std::pair(Step::kGap, model::Utime{60'000}));
  CHECK(second_step(-1327, 100) == std::pair(Step::kLate, model::Utime{-1327}));
  CHECK(second_step(-400'000, 100) == std::pair(Step::kJump, model::Utime{-400'000}));
  CHECK(second_step(600'000'000, 1300) == std::pair(Step::kJump, model::Utime{600'000'000}));
  CHECK(second_step(-600'000'000, 1300) == std::pair(Step::kJump, model::Utime{-600'000'000}));
  // A second of difference is what the clocks may have.
  CHECK(second_step(900'000, 1300) == std::pair(Step::kGap, model::Utime{900'000}));
  CHECK(second_step(1'500'000, 1300) == std::pair(Step::kJump, model::Utime{1'500'000}));
  // Silent for 40 minutes, and for three hours.
  CHECK(second_step(2'400'000'000, 2'400'000'100) ==
        std::pair(Step::kGap, model::Utime{2'400'000'000}));
  CHECK(second_step(3 * kHour_us, 3 * kHour_us) == std::pair(Step::kGap, 3 * kHour_us));
  // The computer's clock was set by ten seconds: the sensor's goes on.
  CHECK(second_step(1327, 10'000'000) == std::pair(Step::kNext, model::Utime{1327}));
}

TEST_CASE("a late packet from before the hour is late, no jump", "[velodyne_driver]") {
  constexpr model::Utime kHour = 1'700'000'000'000'000 / kHour_us * kHour_us;
  VelodyneClock clock;
  clock.take(past_hour(kHour + 400), kHour + 500);
  const auto late = clock.take(past_hour(kHour - 900), kHour + 600);
  CHECK(late.step == Step::kLate);
  CHECK(late.utime == kHour - 900);
  const auto next = clock.take(past_hour(kHour + 1700), kHour + 1800);
  CHECK(next.step == Step::kNext);
  CHECK(next.utime == kHour + 1700);
}
