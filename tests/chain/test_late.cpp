// The whole chain while messages and processes are late and nothing is lost: which outputs are the
// same bytes, and how far the poses of the others are off.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <span>

#include "tests/catch.hpp"
#include "tests/chain/late_chain.hpp"

using namespace understory;
using namespace understory::test;

namespace {

constexpr double kEarliest_s = 5.0;  ///< The vehicle moves from 3 s on.
constexpr double kLongest_s = 10.0;
/// Poses count from so long after the delay on [s].
constexpr double kSettled_s = 0.2;
/// The order of the first revolution's messages decides where time begins [s].
constexpr double kBegun_s = 1.0;

using Channels = std::set<std::string>;

const Channels kSensors = {"RAW_IMU", "RAW_WHEELS", "RAW_SWEEP"};
/// What is made of a keyframe. A late one is fused with what is known by then of the level at rest
/// and of the gyro's bias.
const Channels kOfKeyframes = {"SLAM_POSE", "SLAM_UPDATE", "MAP",
                               "MAP_DELTA", "EXISTENCE",   "EXISTENCE_STATE"};
/// What the filter's corrections act on: they come too late for the stamp at which they should.
const Channels kOfCorrections = {"RAW_POSE",
                                 "LIDAR_SWEEP",
                                 "LANDMARKS",
                                 "VIEW_RANGES",
                                 "PLACE_SCAN",
                                 "KEYFRAME",
                                 "TRACKED_LANDMARKS",
                                 "EKF_POSE",
                                 "EKF_MAP",
                                 "EKF_LEVEL",
                                 "SLAM_POSE",
                                 "SLAM_UPDATE",
                                 "VELOCITY_CORRECTION",
                                 "MAP",
                                 "MAP_DELTA",
                                 "EXISTENCE",
                                 "EXISTENCE_STATE"};

Channels with(Channels channels, const Channels& more) {
  channels.insert(more.begin(), more.end());
  return channels;
}

/// A delay of which nothing is lost.
struct Delay {
  std::string what;
  Channels sensors = {};        ///< Held back, then all in one burst.
  std::string service = {};     ///< Stopped, or
  std::string channel = {};     ///< this one of its outputs is held back.
  double jitter_s = 0.0;        ///< Each message of the sensors by up to so much, instead.
  double twice = 0.0;           ///< Part of the sensors' messages that come twice.
  bool has_wild_clock = false;  ///< The computer's clock jumps.
  Channels may_differ = {};
  double near_m = 0.1;  ///< Most of the distance to the poses of the drive without delays.
  double from_s = 0.0;
  double to_s = 0.0;
};

std::vector<Delay> delays_of_sensors() {
  // A sensor that comes after the time for which others are used is silent until then.
  const Channels of_motion = with(kOfCorrections, {"ODOMETRY", "REST_LEVEL"});
  return {{.what = "sensors up to 20 ms late, out of order", .sensors = kSensors, .jitter_s = 0.02},
          {.what = "a fifth of the sensors' messages twice", .twice = 0.2},
          {.what = "the computer's clock jumps", .has_wild_clock = true},
          {.what = "all sensors held", .sensors = kSensors, .may_differ = kOfCorrections},
          {.what = "RAW_IMU held", .sensors = {"RAW_IMU"}, .may_differ = of_motion, .near_m = 0.25},
          {.what = "RAW_WHEELS held", .sensors = {"RAW_WHEELS"}, .may_differ = of_motion},
          {.what = "RAW_SWEEP held",
           .sensors = {"RAW_SWEEP"},
           .may_differ = of_motion,
           .near_m = 0.35}};
}

std::vector<Delay> delays_of_channels() {
  const auto held = [](const std::string& service, const std::string& channel,
                       const Channels& may_differ) {
    return Delay{.what = channel + " held",
                 .service = service,
                 .channel = channel,
                 .may_differ = may_differ};
  };
  return {held("lidar_imu_input", "ODOMETRY", kOfCorrections),
          held("lidar_imu_input", "REST_LEVEL", kOfKeyframes),
          held("lidar_imu_input", "LIDAR_SWEEP", kOfCorrections),
          held("landmark_extractor", "LANDMARKS", kOfCorrections),
          held("associator", "TRACKED_LANDMARKS", kOfCorrections),
          held("ekf", "EKF_POSE", {}),
          held("ekf", "EKF_LEVEL", with(kOfKeyframes, {"KEYFRAME"})),
          held("ekf", "VELOCITY_CORRECTION", kOfCorrections),
          held("keyframer", "KEYFRAME", kOfKeyframes),
          held("geoslam_mapper", "SLAM_UPDATE", {"EXISTENCE", "EXISTENCE_STATE", "MAP"}),
          held("existence_tracker", "EXISTENCE", {})};
}

std::vector<Delay> stops() {
  const auto stopped = [](const std::string& service, const Channels& may_differ) {
    return Delay{.what = service + " stopped", .service = service, .may_differ = may_differ};
  };
  return {stopped("lidar_imu_input", kOfCorrections), stopped("landmark_extractor", kOfCorrections),
          stopped("associator", kOfCorrections),      stopped("ekf", kOfCorrections),
          stopped("keyframer", kOfKeyframes),         stopped("geoslam_mapper", {}),
          stopped("existence_tracker", {}),           stopped("loop_closer", {})};
}

std::vector<TapeEntry> as_it_comes(std::vector<TapeEntry> tape, const Delay& delay,
                                   std::mt19937_64& random) {
  if (delay.jitter_s == 0.0) return tape;
  std::uniform_real_distribution<double> late_s(0.0, delay.jitter_s);
  for (TapeEntry& entry : tape) {
    if (entry.at_s > kBegun_s) entry.at_s += late_s(random);
  }
  std::ranges::stable_sort(tape, {}, &TapeEntry::at_s);
  return tape;
}

/// Back and forth by up to a year.
bus::Clock wild_clock() {
  const auto random = std::make_shared<std::mt19937_64>(3);
  const auto wild = [random] {
    return std::uniform_int_distribution<std::int64_t>(0, 31'536'000'000'000)(*random);
  };
  return {wild, wild};
}

void begin(LateChain& chain, const Delay& delay) {
  if (delay.jitter_s > 0.0) return;
  for (const std::string& channel : delay.sensors) chain.sensors().hold(channel);
  if (delay.service.empty()) return;
  if (delay.channel.empty()) {
    chain.bus_of(delay.service).stop();
  } else {
    chain.bus_of(delay.service).hold(delay.channel);
  }
}

std::unique_ptr<LateChain> drive(const std::vector<TapeEntry>& tape, const Delay& delay) {
  Surroundings surroundings;
  surroundings.faults.duplicate = delay.twice;
  surroundings.faults.channels = {kSensors.begin(), kSensors.end()};
  if (delay.has_wild_clock) surroundings.clock = wild_clock();
  auto chain = std::make_unique<LateChain>(surroundings);

  bool has_begun = false;
  bool is_over = false;
  for (const TapeEntry& entry : tape) {
    if (!has_begun && entry.at_s >= delay.from_s) begin(*chain, delay);
    has_begun |= entry.at_s >= delay.from_s;
    if (!is_over && entry.at_s >= delay.to_s) chain->go_on();
    is_over |= entry.at_s >= delay.to_s;
    chain->feed(entry.message);
  }
  chain->finish();
  return chain;
}

geometry::SE2 pose_of(const model::SlamPose& pose) { return pose.map_T_vehicle(); }
geometry::SE2 pose_of(const model::EkfPose& pose) { return pose.ekf_map_T_vehicle; }

/// The largest distance of poses with the same stamp, from `from_s` on [m].
template <class Pose>
double apart_m(const std::vector<Pose>& clean, const std::vector<Pose>& late, double from_s) {
  double largest_m = 0.0;
  for (const Pose& one : late) {
    if (1e-6 * static_cast<double>(one.utime) < from_s) continue;
    const auto same = std::ranges::lower_bound(clean, one.utime, {}, &Pose::utime);
    if (same == clean.end() || same->utime != one.utime) continue;
    largest_m =
        std::max(largest_m, (pose_of(*same).translation() - pose_of(one).translation()).norm());
  }
  return largest_m;
}

/// What became of the drives with one kind of delay.
struct Sum {
  int drives = 0;
  std::map<std::string, int> same;  ///< Drives with the same bytes, by channel.
  double slam_m = 0.0;              ///< Largest distances of poses.
  double ekf_m = 0.0;
};

void compare(const LateChain& clean, const LateChain& late, const Delay& delay, Sum& sum) {
  ++sum.drives;
  for (const auto& [channel, messages] : clean.said()) {
    const auto found = late.said().find(channel);
    const bool is_same = found != late.said().end() && found->second == messages;
    sum.same[channel] += is_same ? 1 : 0;
    CAPTURE(channel);
    CHECK((is_same || delay.may_differ.contains(channel)));
  }
  sum.slam_m = std::max(sum.slam_m, apart_m(clean.slam, late.slam, delay.to_s + kSettled_s));
  sum.ekf_m = std::max(sum.ekf_m, apart_m(clean.ekf, late.ekf, delay.to_s + kSettled_s));
  CHECK(late.slam.back().utime == clean.slam.back().utime);
  CHECK(late.slam.back().map_id == clean.slam.back().map_id);
  CHECK(late.ekf.back().utime == clean.ekf.back().utime);
}

void print(const Delay& delay, const Sum& sum) {
  std::string always;
  std::string others;
  for (const auto& [channel, same] : sum.same) {
    if (same == sum.drives) always += " " + channel;
    if (same != sum.drives) others += fmt::format(" {} {}", channel, same);
  }
  fmt::print("{:<40} {:>3} drives, poses apart SLAM {:.4f} EKF {:.4f} m\n", delay.what, sum.drives,
             sum.slam_m, sum.ekf_m);
  if (others.empty()) fmt::print("    same bytes: all\n");
  if (!others.empty()) fmt::print("    same bytes:{}; not always:{}\n", always, others);
  std::fflush(stdout);
}

/// Each kind of delay so many times, at random times and for 0 to 10 s.
void check_delays(int times, std::uint64_t seed) {
  const std::vector<TapeEntry> tape = record({.seed = 31, .length_m = 90.0});
  const auto clean = drive(tape, {.what = "no delay"});
  REQUIRE(clean->slam.size() > 250);
  std::vector<Delay> kinds = delays_of_sensors();
  for (const auto& more : {delays_of_channels(), stops()})
    kinds.insert(kinds.end(), more.begin(), more.end());

  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> from_s(kEarliest_s, tape.back().at_s - kLongest_s - 4.0);
  std::uniform_real_distribution<double> lasts_s(0.0, kLongest_s);
  for (Delay& delay : kinds) {
    Sum sum;
    for (int i = 0; i < times; ++i) {
      delay.from_s = from_s(random);
      delay.to_s = delay.from_s + lasts_s(random);
      CAPTURE(delay.what, delay.from_s, delay.to_s);
      const auto late = drive(as_it_comes(tape, delay, random), delay);
      compare(*clean, *late, delay, sum);
      CHECK(sum.slam_m < delay.near_m);
      CHECK(sum.ekf_m < delay.near_m);
    }
    print(delay, sum);
  }
}

/// ATE of SLAM_POSE while this share of all messages of all processes is lost [m].
double ate_with_losses_m(const std::vector<TapeEntry>& tape,
                         std::span<const eval::metrics::StampedPose> truth, double drop,
                         std::uint64_t seed) {
  Surroundings surroundings;
  surroundings.faults.drop = drop;
  surroundings.seed = seed;
  LateChain chain(surroundings);
  for (const TapeEntry& entry : tape) chain.feed(entry.message);
  chain.finish();
  std::erase_if(chain.slam, [](const model::SlamPose& pose) { return !pose.is_localised(); });
  // Where a fifth is lost, parts of odometry are, and a map may begin beside the first one.
  CHECK(eval::harness::count_maps(chain.slam) <= (drop < 0.15 ? 1 : 2));
  return eval::harness::trajectory_error(chain.slam, truth).ate_rms_m;
}

/// The ATE with losses over that without, `draws` of each share for each drive.
void check_losses(int drives, int draws, std::uint64_t first_seed) {
  std::map<double, std::vector<double>> ratios;
  for (int i = 0; i < drives; ++i) {
    std::vector<eval::metrics::StampedPose> truth;
    const ShortDrive options{.seed = first_seed + static_cast<std::uint64_t>(i), .length_m = 90.0};
    const std::vector<TapeEntry> tape = record(options, &truth);
    const double clean_m = ate_with_losses_m(tape, truth, 0.0, 1);

    for (const double drop : {0.01, 0.05, 0.1, 0.2}) {
      for (int draw = 1; draw <= draws; ++draw) {
        const auto seed = static_cast<std::uint64_t>(draw);
        CAPTURE(options.seed, drop, seed);
        ratios[drop].push_back(ate_with_losses_m(tape, truth, drop, seed) / clean_m);
        CHECK(ratios[drop].back() < 3.0);
      }
    }
  }

  for (const auto& [drop, of] : ratios) {
    double log_sum = 0.0;
    for (const double ratio : of) log_sum += std::log(ratio);
    const double mean = std::exp(log_sum / static_cast<double>(of.size()));
    fmt::print(
        "{:.0f} % of all messages lost: ATE {:.2f} times (geometric mean of {}), up to {:.2f}\n",
        100.0 * drop, mean, of.size(), std::ranges::max(of));
    std::fflush(stdout);
    CHECK(mean < 2.0);
  }
}

}  // namespace

TEST_CASE("of a drive with delays the same bytes come out, but for what corrections act on",
          "[late]") {
  check_delays(2, 7);
}

TEST_CASE("the same, many times", "[.long]") { check_delays(12, 1001); }

TEST_CASE("lost messages cost some millimetres", "[late]") { check_losses(1, 3, 32); }

TEST_CASE("lost messages, many drives", "[.long]") { check_losses(12, 3, 320); }
