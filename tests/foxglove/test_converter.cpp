#include <array>
#include <bit>
#include <random>
#include <set>

#include "common/foxglove/converter.hpp"
#include "common/wire/convert.hpp"
#include "tests/catch.hpp"
#include "tests/foxglove/schema_check.hpp"
#include "tests/foxglove/shown_scene.hpp"
#include "tests/foxglove/synthetic_drive.hpp"
#include "tests/wire/random_message.hpp"

namespace understory::foxglove {
namespace {

using Json = nlohmann::json;

std::vector<Converted> converted(Converter& converter, const std::vector<io::LogEvent>& events) {
  std::vector<Converted> all;
  for (const io::LogEvent& event : events) {
    for (Converted& one : converter.take(event.channel, event.data, event.utime)) {
      all.push_back(std::move(one));
    }
  }
  return all;
}

std::vector<Json> of_topic(const std::vector<Converted>& all, TopicId id) {
  std::vector<Json> result;
  for (const Converted& one : all) {
    if (one.topic == id) result.push_back(Json::parse(*one.json));
  }
  return result;
}

TEST_CASE("every schema is JSON, and every topic has one of its name") {
  std::set<std::string_view> names;
  for (const Topic& one : topics()) {
    REQUIRE(names.insert(one.name).second);
    const Json schema = Json::parse(schema_of(one.id));
    REQUIRE(schema["title"] == std::string(one.schema_name));
    REQUIRE(schema["type"] == "object");
  }
}

TEST_CASE("a drive gives every topic, and every message agrees with its schema") {
  Converter converter;
  const auto all = converted(converter, test::synthetic_drive(120));
  REQUIRE(converter.refused() == 0);
  std::set<TopicId> seen;
  for (const Converted& one : all) {
    seen.insert(one.topic);
    INFO(topic(one.topic).name << " " << one.json->substr(0, 400));
    REQUIRE(test::disagreement(Json::parse(*one.json), Json::parse(schema_of(one.topic))) == "");
    REQUIRE(one.log_time_ns >= one.publish_time_ns);
    REQUIRE(one.log_time_ns - one.publish_time_ns <= 100'000'000);
  }
  // Everything but the pose of a reference system.
  REQUIRE(seen.size() == kTopics - 1);
}

TEST_CASE("the same messages give the same bytes") {
  const auto events = test::synthetic_drive(40);
  Converter first;
  Converter second;
  const auto a = converted(first, events);
  const auto b = converted(second, events);
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) REQUIRE(*a[i].json == *b[i].json);
}

TEST_CASE("what is no message of its channel is counted and gives nothing") {
  Converter converter;
  for (const io::LogEvent& event : test::synthetic_drive(10)) {
    auto data = event.data;
    data[7] = static_cast<std::uint8_t>(data[7] ^ 1U);
    REQUIRE(converter.take(event.channel, data, event.utime).empty());
    data.resize(data.size() / 2);
    REQUIRE(converter.take(event.channel, data, event.utime).empty());
  }
  REQUIRE(converter.refused() > 100);
  REQUIRE(converter.take("SOMETHING_ELSE", {}, 0).empty());
  REQUIRE_FALSE(Converter::takes("SOMETHING_ELSE"));
  REQUIRE(Converter::takes("SLAM_POSE"));
}

/// Random messages of a type, with values at the ends of what numbers hold.
wire::Bytes wild_message(const wire::WireType& type, std::mt19937_64& random) {
  constexpr std::array<double, 6> kWild{1e308, -1e308, 1e300, 5e-324, 0.0, -3.4e38};
  std::vector<test::RealPlace> reals;
  wire::Bytes bytes = test::random_message(type, random, &reals);
  for (const test::RealPlace& place : reals) {
    if (random() % 4 != 0 || place.kind != wire::FieldKind::kDouble) continue;
    const double value = kWild[random() % kWild.size()];
    test::put(bytes, place.offset, std::bit_cast<std::uint64_t>(value), 8);
  }
  return bytes;
}

TEST_CASE("whatever passes the checks of the wire agrees with its schema") {
  std::mt19937_64 random(9);
  Converter converter;
  std::size_t given = 0;
  for (const auto& [channel, type] : std::initializer_list<std::pair<const char*, const char*>>{
           {"SLAM_POSE", "slam_pose2_t"},
           {"SLAM_UPDATE", "slam_update3_t"},
           {"MAP", "map_t"},
           {"MAP_DELTA", "map_delta_t"},
           {"SUBMAP", "submap_t"},
           {"MAP_CORRECTION", "map_correction_t"},
           {"EXISTENCE", "existence_t"},
           {"LANDMARKS", "landmarks_t"},
           {"LIDAR_SCAN", "lidar_scan_t"},
           {"LIDAR_SWEEP", "lidar_sweep_t"},
           {"EKF_POSE", "ekf_pose_t"},
           {"RAW_POSE", "raw_pose_t"},
           {"GROUND_TRUTH", "ground_truth_t"},
           {"TRUTH_LANDMARKS", "truth_landmarks_t"},
           {"GNSS", "gnss_t"},
           {"LOG", "log_t"},
           {"HEALTH", "health_t"},
           {"LOOP_CLOSURE", "loop_closure2_t"},
           {"LOOP_RESULT", "loop_result_t"},
           {"IMU", "imu_t"}}) {
    for (int i = 0; i < 300; ++i) {
      const wire::WireType& layout = *wire::find_wire_type(type);
      const wire::Bytes bytes =
          i % 2 == 0 ? wild_message(layout, random) : test::random_message(layout, random);
      for (const Converted& one : converter.take(channel, bytes, 1)) {
        ++given;
        INFO(topic(one.topic).name << " " << one.json->substr(0, 1000));
        const Json schema = Json::parse(schema_of(one.topic));
        REQUIRE(test::disagreement(Json::parse(*one.json), schema) == "");
      }
    }
  }
  REQUIRE(given > 1000);
}

TEST_CASE("frames hang together: vehicle, odom, the filter's map and the world in the map") {
  Converter converter;
  const auto all = converted(converter, test::synthetic_drive(30));
  const Json last = of_topic(all, TopicId::kTransforms).back();
  std::set<std::string> children;
  for (const Json& one : last["transforms"]) {
    REQUIRE(one["parent_frame_id"] == "map");
    children.insert(one["child_frame_id"]);
  }
  REQUIRE(children == std::set<std::string>{"vehicle", "odom", "ekf_map", "world"});

  // The error of the drive is that of its first pose: the world was tied to it.
  const Json numbers = of_topic(all, TopicId::kPoseNumbers).back();
  REQUIRE(numbers["error_m"].get<double>() < 0.03);
  REQUIRE(numbers["sigma_m"].get<double>() == Approx(0.1));
  REQUIRE(numbers["latency_s"].get<double>() == Approx(0.02));
  REQUIRE(numbers["status"] == "tracked");
}

TEST_CASE("the path stays bounded and covers the drive") {
  Limits limits;
  limits.path_poses = 16;
  limits.path_us = 0;
  Converter converter(limits);
  const auto paths = of_topic(converted(converter, test::synthetic_drive(200)), TopicId::kPath);
  for (const Json& path : paths) REQUIRE(path["poses"].size() <= 16);
  REQUIRE(paths.back()["poses"].size() >= 8);
}

TEST_CASE("a sweep is whole before it is shown, and thinned") {
  Limits limits;
  limits.sweep_points = 100;
  Converter converter(limits);
  const auto clouds = of_topic(converted(converter, test::synthetic_drive(3)), TopicId::kSweep);
  REQUIRE(clouds.size() == 3);
  const std::size_t bytes = 100 * clouds[0]["point_stride"].get<std::size_t>();
  REQUIRE(clouds[0]["data"].get<std::string>().size() == (bytes + 2) / 3 * 4);
}

}  // namespace
}  // namespace understory::foxglove
