// A stage that is stopped and started again in the middle of a drive publishes what it would have
// published without the interruption.
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "common/bus/state_store.hpp"
#include "services/associator/adapter.hpp"
#include "services/ekf/adapter.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/keyframer/adapter.hpp"
#include "services/landmark_extractor/adapter.hpp"
#include "services/lidar_imu_input/adapter.hpp"
#include "tests/catch.hpp"
#include "tests/claims/recorded_chain.hpp"
#include "tests/scratch.hpp"
#include "understory/lidar_sweep_t.hpp"
#include "understory/map_delta_t.hpp"
#include "understory/map_t.hpp"
#include "understory/slam_pose2_t.hpp"
#include "understory/slam_update3_t.hpp"

using namespace understory;
using namespace understory::test;

namespace {

/// One life of a service: recovers its state, takes inputs, ends. With a state directory it
/// journals its inputs.
class Life {
 public:
  Life(const bus::Service& service, const std::string& toml, const std::filesystem::path& state_dir)
      : hosted_(service, bus_, bus::no_clock(), toml, service.name + ".toml"),
        store_(state_dir, service.name) {
    is_recovered_ = hosted_.node().recover(store_);
    hosted_.node().journal_to(&store_);
    for (const std::string& channel : hosted_.node().outputs()) {
      bus_.subscribe(channel, 0, [this, channel](const bus::BusMessage& message) {
        published_.push_back({channel, {message.bytes.begin(), message.bytes.end()}});
      });
    }
    hosted_.node().connect();
    bus_.drain();
  }
  bool is_recovered() const { return is_recovered_; }
  void feed(const RecordedMessage& message) {
    bus_.publish(message.channel, message.bytes);
    bus_.drain();
  }
  /// As a process does on SIGTERM; without it the life ends as if killed.
  void save() { hosted_.node().save_snapshot(); }
  bool takes(const std::string& channel) { return hosted_.node().takes(channel); }
  const Recording& published() const { return published_; }

 private:
  bus::MemoryBus bus_{bus::MemoryBus::Queues::kUnlimited};
  bus::HostedService hosted_;
  bus::StateStore store_;
  Recording published_;
  bool is_recovered_ = false;
};

/// The messages of a recording that a service takes.
Recording inputs_of(const bus::Service& service, const std::string& toml,
                    const Recording& recording) {
  const Scratch scratch("restart-inputs");
  Life life(service, toml, scratch.path());
  Recording inputs;
  std::copy_if(recording.begin(), recording.end(), std::back_inserter(inputs),
               [&](const RecordedMessage& message) { return life.takes(message.channel); });
  return inputs;
}

Recording uninterrupted(const bus::Service& service, const std::string& toml,
                        const Recording& inputs) {
  const Scratch scratch("restart-whole");
  Life life(service, toml, scratch.path());
  for (const RecordedMessage& message : inputs) life.feed(message);
  return life.published();
}

enum class Ending { kStopped, kKilled };

/// The same inputs, but the process ends before the `cut`th and another one goes on.
Recording interrupted(const bus::Service& service, const std::string& toml, const Recording& inputs,
                      std::size_t cut, Ending ending) {
  const Scratch scratch("restart-cut");
  Recording published;
  {
    Life first(service, toml, scratch.path());
    for (std::size_t i = 0; i < cut; ++i) first.feed(inputs[i]);
    if (ending == Ending::kStopped) first.save();
    published = first.published();
  }

  Life second(service, toml, scratch.path());
  REQUIRE(second.is_recovered());
  REQUIRE(second.published().empty());
  for (std::size_t i = cut; i < inputs.size(); ++i) second.feed(inputs[i]);
  published.insert(published.end(), second.published().begin(), second.published().end());
  return published;
}

/// The mapper's graph is saved at its estimates and linearised there again: what is decided is the
/// same to the bit, poses and landmarks differ by what the old linearisations left.
constexpr double kLargestShare = 0.2;   // of the stated standard deviation; 0.10 at most was seen
constexpr double kLandmark_m = 8e-4;    // MAP states no covariance; 3.8e-4 at most was seen
constexpr double kRounding_m2 = 1e-12;  // the first pose is known exactly

bool is_near(const pose2_t& a, const pose2_t& b, const double (&covariance)[3][3]) {
  const Eigen::Vector3d off(b.x - a.x, b.y - a.y, b.theta - a.theta);
  const Eigen::Matrix3d stated = Eigen::Map<const Eigen::Matrix3d>(&covariance[0][0]) +
                                 kRounding_m2 * Eigen::Matrix3d::Identity();
  return off.dot(stated.inverse() * off) < kLargestShare * kLargestShare;
}

bool are_same_poses(const RecordedMessage& expected, const RecordedMessage& got) {
  const auto a = wire::decode_bytes<slam_pose2_t>(expected.bytes).value();
  const auto b = wire::decode_bytes<slam_pose2_t>(got.bytes).value();
  return a.utime == b.utime && a.seq == b.seq && a.status == b.status &&
         a.keyframe_seq == b.keyframe_seq && a.reset_counter == b.reset_counter &&
         is_near(a.submap_T_vehicle, b.submap_T_vehicle, a.covariance) &&
         is_near(a.map_T_odom, b.map_T_odom, a.covariance);
}

bool are_same_updates(const RecordedMessage& expected, const RecordedMessage& got) {
  const auto a = wire::decode_bytes<slam_update3_t>(expected.bytes).value();
  const auto b = wire::decode_bytes<slam_update3_t>(got.bytes).value();
  const auto is_same_pair = [](const association_t& one, const association_t& other) {
    return one.keyframe_landmark == other.keyframe_landmark && one.landmark_id == other.landmark_id;
  };
  const auto is_same_look = [](const expected_landmark_t& one, const expected_landmark_t& other) {
    return one.landmark_id == other.landmark_id && one.sight == other.sight;
  };
  return a.utime == b.utime && a.seq == b.seq && a.status == b.status && a.added == b.added &&
         a.removed == b.removed && a.num_merged == b.num_merged && a.used_prior == b.used_prior &&
         a.inliers == b.inliers && a.degrees_of_freedom == b.degrees_of_freedom &&
         a.reason == b.reason && a.map_id == b.map_id && a.provisional == b.provisional &&
         a.lost == b.lost && std::ranges::equal(a.expected, b.expected, is_same_look) &&
         is_near(a.map_T_vehicle, b.map_T_vehicle, a.covariance) &&
         std::ranges::equal(a.associations, b.associations, is_same_pair);
}

bool are_near_landmarks(const std::vector<map_landmark_t>& a,
                        const std::vector<map_landmark_t>& b) {
  return std::ranges::equal(a, b, [](const map_landmark_t& one, const map_landmark_t& other) {
    return one.id == other.id && std::hypot(one.position_m[0] - other.position_m[0],
                                            one.position_m[1] - other.position_m[1]) < kLandmark_m;
  });
}

bool are_same_maps(const RecordedMessage& expected, const RecordedMessage& got) {
  const auto a = wire::decode_bytes<map_t>(expected.bytes).value();
  const auto b = wire::decode_bytes<map_t>(got.bytes).value();
  return a.utime == b.utime && a.seq == b.seq && a.version == b.version &&
         a.num_keyframes == b.num_keyframes && are_near_landmarks(a.landmarks, b.landmarks);
}

/// Which landmarks moved by more than MAP_DELTA's threshold may differ by those at the threshold.
bool are_same_deltas(const RecordedMessage& expected, const RecordedMessage& got) {
  const auto a = wire::decode_bytes<map_delta_t>(expected.bytes).value();
  const auto b = wire::decode_bytes<map_delta_t>(got.bytes).value();
  return a.utime == b.utime && a.seq == b.seq && a.base_version == b.base_version &&
         a.version == b.version && a.removed == b.removed && a.num_merged == b.num_merged &&
         are_near_landmarks(a.added, b.added);
}

bool are_same(const RecordedMessage& expected, const RecordedMessage& got) {
  if (expected == got) return true;
  if (expected.channel != got.channel) return false;
  if (expected.channel == "SLAM_POSE") return are_same_poses(expected, got);
  if (expected.channel == "SLAM_UPDATE") return are_same_updates(expected, got);
  if (expected.channel == "MAP") return are_same_maps(expected, got);
  if (expected.channel == "MAP_DELTA") return are_same_deltas(expected, got);
  return false;
}

/// Where the runs part; empty = nowhere.
std::string first_difference(const Recording& expected, const Recording& got) {
  const std::size_t common = std::min(expected.size(), got.size());
  std::size_t first = common;
  std::map<std::string, int> differing;
  for (std::size_t i = 0; i < common; ++i) {
    if (are_same(expected[i], got[i])) continue;
    first = std::min(first, i);
    ++differing[expected[i].channel];
  }
  if (first == common && expected.size() == got.size()) return {};

  std::string text = fmt::format("{} messages instead of {}, from number {} on", got.size(),
                                 expected.size(), first);
  for (const auto& [channel, count] : differing) text += fmt::format(", {} {}", count, channel);
  return text;
}

/// False for a part of a sweep that follows another part: a sweep that is under way at a restart is
/// lost, since sweeps are not in the saved state.
bool may_be_cut_at(const RecordedMessage& message) {
  if (message.channel != "RAW_SWEEP" && message.channel != "LIDAR_SWEEP") return true;
  return wire::decode_bytes<lidar_sweep_t>(message.bytes).value().part == 0;
}

void check_restarts(const bus::Service& service, const std::string& toml, const Recording& inputs,
                    Ending ending) {
  REQUIRE(inputs.size() > 20);
  const Recording expected = uninterrupted(service, toml, inputs);
  REQUIRE(expected.size() > 3);

  for (const double share : {0.11, 0.5, 0.83}) {
    auto cut = static_cast<std::size_t>(share * static_cast<double>(inputs.size()));
    while (!may_be_cut_at(inputs.at(cut))) ++cut;
    CAPTURE(service.name, inputs.size(), cut);
    CHECK(first_difference(expected, interrupted(service, toml, inputs, cut, ending)) == "");
  }
}

Recording without(const Recording& recording, const std::string& channel) {
  Recording rest;
  std::copy_if(recording.begin(), recording.end(), std::back_inserter(rest),
               [&](const RecordedMessage& message) { return message.channel != channel; });
  return rest;
}

/// An input that is not in the journal: what it led to since the last snapshot is lost with a
/// killed process, and nothing else.
std::string unjournaled_input(const std::string& service) {
  if (service == "lidar_imu_input") return "RAW_SWEEP";
  if (service == "landmark_extractor") return "LIDAR_SWEEP";
  if (service == "geoslam_mapper") return "LANDMARKS";
  return {};
}

/// Stopped with a snapshot, and killed between two snapshots.
void check_stopped_and_killed(const bus::Service& service, const std::string& toml,
                              const Recording& recording) {
  const Recording inputs = inputs_of(service, toml, recording);
  SECTION("stopped") { check_restarts(service, toml, inputs, Ending::kStopped); }

  const Recording journaled = without(inputs, unjournaled_input(service.name));
  if (journaled.empty()) return;  // The extractor has no state to lose.
  SECTION("killed") { check_restarts(service, toml, journaled, Ending::kKilled); }
}

const Recording& lidar_drive() {
  static const Recording recording = record_lidar_drive(30.0, 4);
  return recording;
}

std::string lidar_toml(const std::string& service) {
  // Snapshots so often that a killed process finds one, and a journal behind it.
  return read_toml(UNDERSTORY_SOURCE_CONFIG "/lidar/" + service + ".toml") +
         "\n[runtime]\nsnapshot_every_events = 70\n";
}

}  // namespace

TEST_CASE("every stage of the LIDAR chain goes on after a restart as if there had been none",
          "[claims][restart]") {
  for (const bus::Service& service : eval::harness::front_end_services()) {
    DYNAMIC_SECTION(service.name) {
      check_stopped_and_killed(service, lidar_toml(service.name), lidar_drive());
    }
  }
}
