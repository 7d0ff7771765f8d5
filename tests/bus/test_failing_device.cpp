// A device that fails in the middle of a drive: EIO from each call that changes a state file on.
#include <cstdio>

#include "tests/bus/failing_files.hpp"
#include "tests/bus/toy_life.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::test;

namespace {

constexpr int kBefore = 24;  ///< Inputs before the device fails; ten are a second.
constexpr int kWithout = 30;

/// Inputs that the state of a life has; the toy's sum shows that it is the state of exactly these.
int inputs_of(Life& life) {
  int count = 0;
  double sum = 0.0;
  REQUIRE(std::sscanf(life.hosted.adapter().save().c_str(), "%d %lf", &count, &sum) == 2);
  CHECK(sum == 0.5 * count * (count + 1));
  return count;
}

/// The next process after a kill at this moment.
void check_recovers(const std::filesystem::path& directory, int at_least, int at_most) {
  Life next(directory);
  CHECK(next.is_recovered);
  const int inputs = inputs_of(next);
  CHECK(inputs >= at_least);
  CHECK(inputs <= at_most);
}

}  // namespace

TEST_CASE("EIO in a drive is told at once, costs nothing, and is over when the device is back") {
  const auto expected = uninterrupted(120);
  const std::string toml = GENERATE(as<std::string>(), "[runtime]\nsnapshot_every_events = 7\n",
                                    "[runtime]\nsnapshot_every_events = 1\n", "");
  for (long first = 1; first < 30; ++first) {
    CAPTURE(toml, first);
    const Scratch scratch("failing-device");
    std::int64_t now = 0;
    const bus::Clock clock{[&] { return now; }, [&] { return now; }};
    FailingFiles files;
    {
      Life life(scratch.path(), toml, clock);
      life.run(0, kBefore);
      files.fail_from(first);
      for (int i = kBefore; i < kBefore + kWithout; ++i) {
        life.run(i, i + 1);
        now += 100'000;
        const auto state = life.hosted.node().monitor().state();
        CHECK(state == (files.failures() > 0 ? health_t::STATE_DEGRADED : health_t::STATE_OK));
      }
      REQUIRE(files.failures() > 0);
      CHECK(life.hosted.node().health().last_error_code == "state_not_kept");

      // Within two seconds of its return the state is kept again, which HEALTH shows within five.
      files.set_whole();
      life.run(kBefore + kWithout, kBefore + kWithout + 20);
      CHECK(life.hosted.node().monitor().state() == health_t::STATE_DEGRADED);
      now += 5'000'000;
      CHECK(life.hosted.node().monitor().state() == health_t::STATE_OK);
      REQUIRE(life.poses.size() == kBefore + kWithout + 20);
      for (std::size_t i = 0; i < life.poses.size(); ++i)
        CHECK(wire::encode_bytes(life.poses[i]) == wire::encode_bytes(expected[i]));
    }
    check_recovers(scratch.path(), kBefore + kWithout + 20, kBefore + kWithout + 20);
  }
}

TEST_CASE("a process that is killed while the device fails goes on from what was kept before") {
  const std::string toml = GENERATE(as<std::string>(), "[runtime]\nsnapshot_every_events = 7\n",
                                    "[runtime]\nsnapshot_every_events = 1\n", "");
  for (long first = 1; first < 30; ++first) {
    CAPTURE(toml, first);
    const Scratch scratch("failing-device");
    FailingFiles files;
    {
      Life life(scratch.path(), toml);
      life.run(0, kBefore);
      files.fail_from(first);
      life.run(kBefore, kBefore + kWithout);
    }
    files.set_whole();
    check_recovers(scratch.path(), kBefore, kBefore + kWithout);
  }
}
