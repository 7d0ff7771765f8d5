// What is counted of a log, by hand.
#include <vector>

#include "common/wire/convert.hpp"
#include "deploy/cli/log_statistics.hpp"
#include "deploy/cli/slam_results.hpp"
#include "tests/catch.hpp"

using namespace understory;
using namespace understory::cli;

namespace {

/// An event of a sweep's scan with this stamp and sequence.
io::LogEvent scan_event(std::int64_t number, std::int64_t utime, std::uint64_t sequence) {
  model::LandmarkScan scan;
  scan.utime = utime;
  scan.sequence = sequence;
  return {number, utime, "LANDMARKS", wire::encode_message(scan)};
}

LogStatistics statistics_of(const std::vector<io::LogEvent>& events) {
  LogStatistics statistics;
  for (const io::LogEvent& event : events) statistics.add(event);
  return statistics;
}

}  // namespace

TEST_CASE("one lost message is counted, and one lost event", "[cli]") {
  const LogStatistics statistics =
      statistics_of({scan_event(0, 1'000'000, 4), scan_event(1, 2'000'000, 6),
                     scan_event(3, 3'000'000, 7), scan_event(7, 4'000'000, 12)});
  CHECK(statistics.missing_numbers() == 1 + 3);
  const ChannelStatistics& channel = statistics.channels().at("LANDMARKS");
  CHECK(channel.malformed == 0);
  CHECK(channel.lost == 1 + 4);
  CHECK(channel.restarts == 0);
  CHECK(channel.rate_hz() == Approx(1.0));
}

TEST_CASE("clocks that go back, jumps and restarts are counted", "[cli]") {
  const LogStatistics statistics = statistics_of(
      {scan_event(0, 5'000'000, 4), scan_event(1, 4'000'000, 5), scan_event(2, 14'000'000, 6),
       scan_event(3, 24'000'001, 0), scan_event(4, 24'000'000, 1), scan_event(5, 25'000'000, 2),
       scan_event(6, 25'000'000, 3), scan_event(7, 26'000'000, 4)});
  CHECK(statistics.clock_back() == 2);
  CHECK(statistics.clock_forward() == 1);
  CHECK(statistics.longest_silence_s() == Approx(10.000001));
  const ChannelStatistics& channel = statistics.channels().at("LANDMARKS");
  CHECK(channel.lost == 0);
  CHECK(channel.restarts == 1);
  CHECK(channel.stamps_back == 2);
}

TEST_CASE("a trajectory for other tools has seconds, metres and a quaternion", "[cli]") {
  CHECK(to_tum({{1'700'000'000'250'000, geometry::SE2(1.5, -2.25, 0.0)}, {1, {}}}) ==
        "1700000000.250000 1.5 -2.25 0 0 0 0 1\n0.000001 0 0 0 0 0 0 1\n");
}

TEST_CASE("KITTI's format pairs a live pose with the true pose of its time", "[cli]") {
  CHECK(to_kitti({{7, geometry::SE2(1.5, -2.25, 0.0)}}) == "1 -0 0 1.5 0 1 0 -2.25 0 0 1 0\n");

  SlamResults results;
  for (model::Utime utime = 0; utime < 10; ++utime) {
    model::SlamPose pose;
    pose.utime = 100'000 * utime;
    pose.submap_T_vehicle = {0.1 * static_cast<double>(utime), 0.0, 0.0};
    results.poses.push_back(pose);
  }
  CHECK(paired_trajectories(results).live.size() == 10);
  CHECK(paired_trajectories(results).truth.empty());

  // The truth begins after the third pose, at other times.
  for (model::Utime utime = 250'000; utime < 2'000'000; utime += 100'000)
    results.truth.emplace_back(utime, geometry::SE2(1e-6 * static_cast<double>(utime), 0.0, 0.0));
  const PairedTrajectories paired = paired_trajectories(results);
  REQUIRE(paired.live.size() == 7);
  REQUIRE(paired.truth.size() == 7);
  for (std::size_t i = 0; i < 7; ++i) {
    CHECK(paired.live[i].first == paired.truth[i].first);
    CHECK(paired.live[i].second.x() == Approx(paired.truth[i].second.x()));
  }
}
