// Sequence numbers, percentiles, time.
#include <algorithm>
#include <random>
#include <set>

#include "common/bus/health_monitor.hpp"
#include "common/bus/latency_histogram.hpp"
#include "common/bus/message_clock.hpp"
#include "common/bus/sequence_tracker.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::bus;

TEST_CASE("losses, duplicates and late comers are counted exactly under random faults") {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    std::mt19937_64 random(seed);

    // Some of 0..1999 are lost, some come twice, some come up to 20 places late.
    std::vector<std::pair<double, std::int64_t>> arrivals;
    std::set<std::int64_t> distinct;
    std::uint64_t duplicates = 0;

    for (std::int64_t i = 0; i < 2000; ++i) {
      const auto chance = random() % 100;
      if (i > 0 && i < 1999 && chance < 10) continue;
      distinct.insert(i);
      const bool is_late = i > 0 && i < 1999 && chance < 20;
      arrivals.emplace_back(static_cast<double>(i) + (is_late ? 1.5 + random() % 20 : 0.0), i);
      if (chance > 90) {
        arrivals.emplace_back(arrivals.back().first + 0.25, i);
        ++duplicates;
      }
    }

    std::stable_sort(arrivals.begin(), arrivals.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::uint64_t late = 0;
    std::int64_t newest = -1;
    std::set<std::int64_t> had;
    SequenceTracker tracker;

    for (const auto& [when, sequence] : arrivals) {
      const bool is_duplicate = !had.insert(sequence).second;
      if (!is_duplicate && sequence < newest) ++late;
      newest = std::max(newest, sequence);
      const Arrival arrival = tracker.take(sequence, 1000 + sequence);
      CHECK((arrival == Arrival::kDuplicate) == is_duplicate);
    }

    CHECK(tracker.counts().messages == arrivals.size());
    CHECK(tracker.counts().duplicates == duplicates);
    CHECK(tracker.counts().late == late);
    CHECK(tracker.counts().lost == 2000 - distinct.size());
    CHECK(tracker.counts().restarts == 0);
  }
}

TEST_CASE("a sender that counts from the start again is no late comer") {
  SequenceTracker tracker;
  for (int i = 0; i < 10; ++i) tracker.take(i, 100 + i);
  CHECK(tracker.take(0, 200) == Arrival::kFirst);
  CHECK(tracker.take(1, 201) == Arrival::kNext);
  CHECK(tracker.counts().restarts == 1);
  CHECK(tracker.counts().lost == 0);
}

TEST_CASE("what was sent before the first message that came is late, and no loss") {
  SequenceTracker tracker;
  tracker.take(3, 103);
  CHECK(tracker.take(1, 101) == Arrival::kLate);
  CHECK(tracker.take(1, 101) == Arrival::kDuplicate);
  CHECK(tracker.take(5, 105) == Arrival::kAfterGap);
  CHECK(tracker.counts().lost == 1);
  CHECK(tracker.take(2, 102) == Arrival::kLate);
  CHECK(tracker.counts().lost == 1);
  CHECK(tracker.take(4, 104) == Arrival::kLate);
  CHECK(tracker.counts().lost == 0);
}

TEST_CASE("a step of up to a million is a loss, a larger one another sequence") {
  for (const std::int64_t step : {2, 1'000, 1'001, 999'999, 1'000'000, 1'000'001, 3'999'999}) {
    CAPTURE(step);
    const bool is_loss = step <= 1'000'000;
    SequenceTracker tracker;
    tracker.take(7, 100);
    CHECK(tracker.take(7 + step, 101) == (is_loss ? Arrival::kAfterGap : Arrival::kFirst));
    CHECK(tracker.counts().lost == (is_loss ? static_cast<std::uint64_t>(step - 1) : 0));
    CHECK(tracker.counts().restarts == (is_loss ? 0 : 1));
  }
}

TEST_CASE("a hostile sequence number does not poison what follows") {
  SequenceTracker tracker;
  tracker.take(5, 100);
  tracker.take(std::int64_t{1} << 62U, 101);
  CHECK(tracker.take(6, 102) == Arrival::kFirst);
  CHECK(tracker.take(7, 103) == Arrival::kNext);
  CHECK(tracker.counts().lost == 0);
}

TEST_CASE("percentiles agree with sorting, within a sixteenth") {
  std::mt19937_64 random(4);
  std::lognormal_distribution<double> spread(6.0, 2.0);
  LatencyHistogram histogram;
  std::vector<std::int64_t> values;

  for (int i = 0; i < 20000; ++i) {
    values.push_back(static_cast<std::int64_t>(spread(random)));
    histogram.add(values.back());
  }

  std::sort(values.begin(), values.end());
  for (const double q : {0.01, 0.5, 0.9, 0.99, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * 20000.0)) - 1;
    const double exact = static_cast<double>(values[rank]);
    const auto estimate = static_cast<double>(histogram.quantile(q));
    CHECK(estimate >= exact);
    CHECK(estimate <= exact * (1.0 + 1.0 / 16.0) + 1.0);
  }

  CHECK(histogram.max() == values.back());
  CHECK(LatencyHistogram().quantile(0.5) == 0);
}

TEST_CASE("one wrong stamp is not believed, three that agree are") {
  using Verdict = MessageClock::Verdict;
  MessageClock clock(10000000);
  const std::int64_t start = 1000000000;
  CHECK(clock.take(start) == Verdict::kFine);
  CHECK(clock.take(start * 100) == Verdict::kQuarantined);
  CHECK(clock.take(start + 100) == Verdict::kFine);
  CHECK_FALSE(clock.is_waiting());
  CHECK(clock.now() == start + 100);
  CHECK(clock.take(5) == Verdict::kQuarantined);
  CHECK(clock.take(6) == Verdict::kAgrees);
  CHECK(clock.take(7) == Verdict::kJumped);
  CHECK(clock.now() == 7);
}

TEST_CASE("a stamp is believed up to the largest jump, and far stamps only where they agree") {
  constexpr std::int64_t kJump_us = 10'000'000;
  constexpr std::int64_t kStart = 1'000'000'000;
  using Verdict = MessageClock::Verdict;
  MessageClock clock(kJump_us);
  clock.take(kStart);
  CHECK(clock.take(kStart - kJump_us) == Verdict::kFine);
  CHECK(clock.now() == kStart);
  CHECK(clock.take(kStart - kJump_us - 1) == Verdict::kQuarantined);
  CHECK(clock.take(kStart + kJump_us) == Verdict::kFine);
  CHECK(clock.take(kStart + 2 * kJump_us + 1) == Verdict::kQuarantined);

  // Far below and far beyond what the pause before it would explain: none proves another.
  CHECK(clock.take(10 * kStart) == Verdict::kQuarantined);
  CHECK(clock.take(9 * kStart) == Verdict::kQuarantined);
  CHECK(clock.take(9'000 * kStart) == Verdict::kQuarantined);
  // Time that goes on after a pause.
  CHECK(clock.take(20 * kStart) == Verdict::kQuarantined);
  CHECK(clock.take(25 * kStart) == Verdict::kAgrees);
  CHECK(clock.take(30 * kStart) == Verdict::kJumped);
}

TEST_CASE("a slow channel and one that is behind need no proof") {
  using Verdict = MessageClock::Verdict;
  constexpr std::int64_t kSecond_us = 1'000'000;
  MessageClock clock(10 * kSecond_us);
  ChannelPace slow{-1, 0};
  clock.take(1000 * kSecond_us, slow);
  slow = {1000 * kSecond_us, 32 * kSecond_us};
  CHECK(clock.take(1090 * kSecond_us, slow) == Verdict::kFine);
  CHECK(clock.take(1190 * kSecond_us, slow) == Verdict::kQuarantined);

  // Behind, in order, and not believed to be the time; out of order it needs proof.
  CHECK(clock.take(1060 * kSecond_us, {-1, 0}) == Verdict::kFine);
  CHECK(clock.take(1062 * kSecond_us, {1060 * kSecond_us, 0}) == Verdict::kFine);
  CHECK(clock.now() == 1090 * kSecond_us);
  CHECK(clock.take(1061 * kSecond_us, {1062 * kSecond_us, 0}) == Verdict::kQuarantined);

  // Where all are behind the time was wrong.
  Verdict verdict = Verdict::kFine;
  for (int i = 0; i < 100 && verdict == Verdict::kFine; ++i) {
    verdict = clock.take((1063 + i / 10) * kSecond_us, {1062 * kSecond_us, 0});
  }
  CHECK(verdict == Verdict::kJumped);
  CHECK(clock.now() < 1070 * kSecond_us);
}

TEST_CASE("whatever degrades the state of health is its last reason") {
  std::mt19937_64 random(11);
  for (int run = 0; run < 200; ++run) {
    std::int64_t now = 0;
    HealthMonitor monitor("toy", "1", {[&] { return now + 5; }, [&] { return now; }});
    const std::size_t channel = monitor.add_channel("IN", false);
    monitor.ready();
    SequenceCounts counts;
    std::uint64_t dropped = 0;
    for (int step = 0; step < 10; ++step) {
      now += 10 * ReasonCounts::kFreshUs;
      CHECK(monitor.state() == health_t::STATE_OK);
      std::string code;
      switch (random() % 3) {
        case 0:
          ++counts.gaps;
          counts.lost += 1 + random() % 5;
          monitor.set_sequence(channel, counts);
          code = "messages_lost";
          break;
        case 1:
          dropped += 1 + random() % 5;
          monitor.set_dropped(channel, dropped);
          code = "queue_full";
          break;
        default:
          monitor.count_reason("IN", wire::Reason::kNotFinite, "x");
          code = "not_finite";
      }
      CHECK(monitor.state() == health_t::STATE_DEGRADED);
      const health_t report = monitor.report(1);
      CHECK(report.last_error_code == code);
      CHECK(report.last_error.starts_with("IN: "));
      CHECK(report.last_error_utime == now + 5);
    }
  }
}

TEST_CASE("health follows from fresh reasons and recovers") {
  std::int64_t now = 0;
  HealthMonitor monitor("toy", "1", {[&] { return now + 5; }, [&] { return now; }});
  const std::size_t channel = monitor.add_channel("IN", false);
  CHECK(monitor.state() == health_t::STATE_STARTING);
  monitor.ready();
  CHECK(monitor.state() == health_t::STATE_OK);
  monitor.count_reason("IN", wire::Reason::kDuplicate, "twice");

  CHECK(monitor.state() == health_t::STATE_OK);
  monitor.count_reason("IN", wire::Reason::kNotFinite, "x");
  CHECK(monitor.state() == health_t::STATE_DEGRADED);
  monitor.count_reason("", wire::Reason::kStageFailed, "y");
  CHECK(monitor.state() == health_t::STATE_ERROR);
  now = ReasonCounts::kFreshUs;
  CHECK(monitor.state() == health_t::STATE_OK);

  for (int i = 0; i < 30; ++i) monitor.count_message(channel, 100 + i);
  for (int i = 1; i <= 100; ++i) monitor.count_latency(i);
  const health_t report = monitor.report(129);
  CHECK(report.channels.at(0).messages == 30);
  CHECK(report.channels.at(0).rate_hz == Approx(30.0 / 3.0));
  CHECK(report.channels.at(0).malformed == 1);
  CHECK(report.handled == 30);

  CHECK(report.latency_p50_us >= 50);
  CHECK(report.latency_p50_us <= 54);
  CHECK(report.latency_max_us == 100);
  CHECK(report.last_error_code == "stage_failed");
  CHECK(report.rss_bytes > 0);
  REQUIRE(report.reasons.size() == 3);
  CHECK(report.reasons[1].reason == "duplicate");

  CHECK(report.reasons[1].count == 1);
}
