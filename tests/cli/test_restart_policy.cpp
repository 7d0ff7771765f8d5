#include <random>

#include "deploy/launch/restart_policy.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::launch;

TEST_CASE("back-off doubles and never exceeds its limits", "[launch]") {
  launch::RestartPolicyParameters parameters;
  parameters.max_deaths = 1000;
  launch::RestartPolicy policy(parameters);
  launch::milliseconds before{0};
  for (int i = 0; i < 20; ++i) {
    const auto wait = policy.died(launch::Clock::time_point{}, launch::milliseconds(0));
    CHECK_FALSE(policy.is_given_up());
    CHECK(wait >= parameters.first_backoff);
    CHECK(wait <= parameters.max_backoff);
    if (i > 0) CHECK(wait == std::min(parameters.max_backoff, 2 * before));
    before = wait;
  }
}

TEST_CASE("gives up exactly at the fifth death within thirty seconds", "[launch]") {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<int> step_ms(0, 20'000);
  for (int run = 0; run < 200; ++run) {
    launch::RestartPolicy policy;
    std::vector<launch::Clock::time_point> deaths;
    launch::Clock::time_point now{};

    for (int i = 0; i < 30; ++i) {
      now += launch::milliseconds(step_ms(random));
      deaths.push_back(now);
      const auto recent = std::count_if(
          deaths.begin(), deaths.end(),
          [&](launch::Clock::time_point t) { return now - t <= launch::milliseconds(30'000); });
      policy.died(now, launch::milliseconds(0));
      REQUIRE(policy.is_given_up() == (recent >= 5));
      if (policy.is_given_up()) break;
    }
  }
}

TEST_CASE("a death as old as the window counts, an older one does not", "[launch]") {
  const launch::RestartPolicyParameters parameters;
  for (const launch::milliseconds beyond : {launch::milliseconds(0), launch::milliseconds(1)}) {
    launch::RestartPolicy policy(parameters);
    const launch::Clock::time_point first{};
    for (int i = 0; i < 4; ++i) policy.died(first, launch::milliseconds(0));
    REQUIRE_FALSE(policy.is_given_up());
    policy.died(first + parameters.window + beyond, launch::milliseconds(0));
    CHECK(policy.is_given_up() == (beyond.count() == 0));
    CHECK(policy.deaths_in_window() == (beyond.count() > 0 ? 1 : 5));
  }
}

TEST_CASE("what is given up is tried at the slow pace until it lives for a window", "[launch]") {
  const launch::RestartPolicyParameters parameters;
  std::mt19937_64 random(6);
  std::uniform_int_distribution<int> lived_ms(0, 29'999);
  launch::RestartPolicy policy;
  launch::Clock::time_point now{};
  for (int i = 0; i < 5; ++i) policy.died(now, launch::milliseconds(0));

  for (int i = 0; i < 200; ++i) {
    const launch::milliseconds lived(lived_ms(random));
    now += parameters.slow_retry + lived;
    REQUIRE(policy.died(now, lived) == parameters.slow_retry);
    REQUIRE(policy.is_given_up());
  }

  now += parameters.slow_retry + parameters.window;
  CHECK(policy.died(now, parameters.window) == parameters.first_backoff);
  CHECK_FALSE(policy.is_given_up());
}
