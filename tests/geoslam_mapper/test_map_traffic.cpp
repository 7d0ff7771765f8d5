// How often the mapper sends its map whole: by the bytes on a bus.
#include <map>
#include <memory>
#include <set>

#include "common/bus/memory_bus.hpp"
#include "common/model/held_map.hpp"
#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/geoslam_mapper/map_budget.hpp"
#include "services/keyframer/adapter.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"
#include "understory/map_request_t.hpp"

using namespace understory;

namespace {

/// Keyframer and mapper on one bus, with what a listener hears.
class MappingOnABus {
 public:
  explicit MappingOnABus(const std::string& mapper_toml = "") {
    host(keyframer::keyframer_service(), "");
    host(geoslam_mapper::geoslam_mapper_service(), mapper_toml);
  }

  void feed(const std::string& channel, const wire::Bytes& bytes) {
    bus_.publish(channel, bytes);
    bus_.drain();
  }
  /// Feeds scans first..last-1.
  void drive(const sim::Drive& drive, std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      feed("LANDMARKS", wire::encode_message(drive.scan(k).scan));
    }
  }
  /// The same as the continuation of another drive, a second after it.
  void drive(const sim::Drive& drive, std::size_t first, std::size_t last,
             const sim::Drive& before) {
    for (std::size_t k = first; k < last; ++k) {
      model::LandmarkScan scan = drive.scan(k).scan;
      scan.sequence += before.size();
      scan.utime += before.utime(before.size() - 1) - drive.utime(0) + 1'000'000;
      feed("LANDMARKS", wire::encode_message(scan));
    }
  }
  void request(bool everything) {
    map_request_t request{};
    request.everything = everything ? 1 : 0;
    request.max_m[0] = request.max_m[1] = 1.0;
    feed("MAP_REQUEST", wire::encode_message(request));
  }
  void finish() {
    for (auto& one : hosted_) one->adapter().finish();
  }

  /// Share of MAP among all that the mapper has sent.
  double map_share() const {
    double sum = 0.0;
    for (const auto& [_, bytes] : bytes_) sum += bytes;
    return sum == 0.0 ? 0.0 : bytes_.at("MAP") / sum;
  }
  const std::vector<model::WholeMap>& maps() const { return maps_; }
  const model::HeldMap& held() const { return held_; }
  const std::optional<model::SlamPose>& last_pose() const { return last_pose_; }
  int lost_poses() const { return lost_poses_; }
  const std::set<std::uint32_t>& new_maps() const { return new_maps_; }

 private:
  void host(const bus::Service& service, const std::string& toml) {
    hosted_.push_back(std::make_unique<bus::HostedService>(service, bus_, bus::no_clock(), toml,
                                                           service.name + ".toml"));
    hosted_.back()->node().connect();
  }
  void hear(const bus::BusMessage& message) {
    const auto found = bytes_.find(message.channel);
    if (found == bytes_.end()) return;
    found->second += static_cast<double>(message.bytes.size());
    if (message.channel == "MAP") {
      maps_.push_back(wire::decode_message<model::WholeMap>(message.bytes).value());
      held_.take(maps_.back());
    } else if (message.channel == "MAP_DELTA") {
      held_.take(wire::decode_message<model::MapDelta>(message.bytes).value());
    } else if (message.channel == "SLAM_POSE") {
      last_pose_ = wire::decode_message<model::SlamPose>(message.bytes).value();
      if (last_pose_->is_lost) ++lost_poses_;
      if (last_pose_->is_new_map) new_maps_.insert(last_pose_->map_id);
    } else if (message.channel == "SLAM_UPDATE") {
      held_.take(wire::decode_message<model::MapUpdate>(message.bytes).value());
    }
  }

  std::map<std::string, double, std::less<>> bytes_{
      {"MAP", 0.0}, {"MAP_DELTA", 0.0}, {"SLAM_POSE", 0.0}, {"SLAM_UPDATE", 0.0}};
  std::vector<model::WholeMap> maps_;
  model::HeldMap held_;
  std::optional<model::SlamPose> last_pose_;
  int lost_poses_ = 0;
  std::set<std::uint32_t> new_maps_;  ///< By poses that say NEW_MAP.
  bus::MemoryBus bus_{bus::MemoryBus::Queues::kUnlimited,
                      [this](const bus::BusMessage& message) { hear(message); }};
  std::vector<std::unique_ptr<bus::HostedService>> hosted_;
};

/// Straight ahead: the map grows all the way.
sim::Drive growing_drive(double length_m, std::uint64_t seed = 5) {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.path.kind = sim::PathKind::kLine;
  parameters.path.length_m = length_m;
  parameters.clear_the_path = true;
  return {parameters, seed};
}

void check_same_landmarks(const model::HeldMap& held, const model::WholeMap& map) {
  REQUIRE(held.map());
  REQUIRE(held.map()->landmarks.size() == map.landmarks.size());
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    const auto& one = held.map()->landmarks[i];
    CHECK(one.id == map.landmarks[i].id);
    // As map_difference.hpp says; twice where the copy began with a MAP.
    const double sigma_m = std::sqrt(0.5 * one.covariance_m2.trace());
    const double tolerated_m = 2.0 * std::max(0.001, std::min(0.10, 0.25 * sigma_m));
    CHECK((one.position_m - map.landmarks[i].position_m).norm() <= tolerated_m + 1e-9);
  }
}

}  // namespace

TEST_CASE("the map is sent whole within its share of the bytes while it grows", "[map_traffic]") {
  const sim::Drive drive = growing_drive(300.0);
  MappingOnABus mapping;
  mapping.drive(drive, 0, drive.size() / 3);
  REQUIRE_FALSE(mapping.maps().empty());  // It started.

  for (std::size_t k = drive.size() / 3; k < drive.size(); k += 100) {
    mapping.drive(drive, k, std::min(k + 100, drive.size()));
    CHECK(mapping.map_share() <= 0.1);
  }
  CHECK(mapping.maps().size() >= 3);  // A late reader finds one.
  CHECK(mapping.held().missed() == 0);

  // The last one comes at the end: who followed the changes has the same landmarks.
  const model::HeldMap followed = mapping.held();
  const std::size_t before = mapping.maps().size();
  mapping.finish();
  REQUIRE(mapping.maps().size() == before + 1);
  check_same_landmarks(followed, mapping.maps().back());
  CHECK(followed.map()->keyframes.size() == mapping.maps().back().keyframes.size());
}

TEST_CASE("a request for the map is answered at once, whatever the budget", "[map_traffic]") {
  const sim::Drive drive = growing_drive(60.0);
  MappingOnABus mapping("[output]\nmap_share = 0.0\n");
  mapping.drive(drive, 0, drive.size());
  REQUIRE(mapping.maps().size() == 1);  // The start.

  for (std::size_t i = 0; i < 5; ++i) {
    mapping.request(true);
    REQUIRE(mapping.maps().size() == 2 + i);
    CHECK(mapping.maps().back().complete);
  }
  check_same_landmarks(mapping.held(), mapping.maps().back());
  mapping.request(false);
  REQUIRE(mapping.maps().size() == 7);
  CHECK_FALSE(mapping.maps().back().complete);
}

TEST_CASE("another map is sent whole at once, and who listens holds it alone", "[map_traffic]") {
  const sim::Drive here = growing_drive(60.0);
  const sim::Drive there = growing_drive(60.0, 1005);
  MappingOnABus mapping("[output]\nmap_share = 0.0\n");
  mapping.drive(here, 0, here.size());
  const std::size_t before = mapping.maps().size();
  const std::uint64_t version = mapping.held().map()->version;

  std::size_t waited = 0;
  for (; waited < there.size() && mapping.maps().size() == before; ++waited)
    mapping.drive(there, waited, waited + 1, here);
  CHECK(waited <= 33);  // Four keyframes: tracking begins anew, and the first of them is shorter.
  REQUIRE(mapping.maps().size() == before + 1);
  mapping.drive(there, waited, there.size(), here);
  CHECK(mapping.held().missed() == 0);
  CHECK(mapping.held().has_whole());
  CHECK(mapping.held().map()->version > version);
  for (const auto& one : mapping.held().map()->landmarks) CHECK(model::map_of(one.id) == 2);

  // A pose of the new map has its number, and the jump is counted though nothing is known of it.
  REQUIRE(mapping.last_pose());
  CHECK(mapping.last_pose()->is_localised());
  CHECK(mapping.last_pose()->map_id == 2);
  CHECK(mapping.lost_poses() == 2);
  CHECK(mapping.new_maps() == std::set<std::uint32_t>{2});
  CHECK(mapping.last_pose()->reset_counter == 1);
  CHECK(mapping.last_pose()->reset_delta.coordinates().norm() == 0.0);

  mapping.request(true);
  check_same_landmarks(mapping.held(), mapping.maps().back());
}

TEST_CASE("a budget never spends more than its share and one map", "[map_traffic]") {
  geoslam_mapper::MapBudget budget(0.2);
  double others = 0.0;
  double maps = 0.0;
  std::size_t map = 1000;
  for (int i = 0; i < 10000; ++i) {
    budget.earn(137);
    others += 137.0;
    map += 7;
    const bool is_due = i % 50 == 0;
    if (!(is_due && budget.may_borrow()) && !budget.affords(map)) continue;
    budget.spend(map);
    maps += static_cast<double>(map);
    CHECK(maps - static_cast<double>(map) <= 0.2 * (maps + others));
  }
  CHECK(maps > 0.15 * (maps + others));
}
