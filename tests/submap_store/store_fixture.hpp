// Random submaps, and the store on a bus in memory.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include "common/bus/device.hpp"
#include "common/bus/memory_bus.hpp"
#include "common/bus/service.hpp"
#include "common/map_file/map_file.hpp"
#include "common/wire/convert.hpp"
#include "services/submap_store/adapter.hpp"
#include "tests/catch.hpp"
#include "tests/io/log_fixture.hpp"
#include "understory/health_t.hpp"
#include "understory/map_request_t.hpp"

namespace understory::test {

/// A submap with landmarks around its origin. Its landmarks' ids follow from its number.
inline model::Submap random_submap(std::uint32_t map_id, model::SubmapId id,
                                   std::mt19937_64& random, std::size_t landmarks = 40) {
  std::normal_distribution<double> normal;
  model::Submap submap;
  submap.utime = static_cast<model::Utime>(1'000'000 * id);
  submap.map_id = map_id;
  submap.id = id;
  submap.map_T_submap = {30.0 * static_cast<double>(id), normal(random), 0.1 * normal(random)};
  for (std::size_t i = 0; i < landmarks; ++i) {
    model::MapLandmark one;
    one.id = map_file::landmark_id(map_id, 1000 * id + i);
    one.position_m = {15.0 * normal(random), 15.0 * normal(random)};
    Eigen::Matrix2d root;
    root << 0.05 * normal(random), 0.05 * normal(random), 0.0, 0.05 * normal(random);
    one.covariance_m2 = root * root.transpose();
    one.radius_m = 0.1 + 0.05 * std::abs(normal(random));
    one.observation_count = static_cast<std::uint32_t>(random() % 500);
    if (random() % 4 == 0) one.kind = model::LandmarkKind::kCorner;
    submap.landmarks.push_back(one);
  }
  for (std::uint64_t k = 0; k < 5; ++k) {
    submap.keyframes.push_back({10 * id + k,
                                submap.utime + static_cast<model::Utime>(100'000 * k),
                                {6.0 * static_cast<double>(k) - 15.0, normal(random), 0.01},
                                1e-4 * Eigen::Matrix3d::Identity()});
  }
  for (int i = 0; i < 2000; ++i) submap.payload.push_back(static_cast<char>(random() % 17));
  submap.content_hash = model::fnv1a(submap.payload);
  return submap;
}

/// Whether what comes back is what was given, but for the rounding of landmarks.
inline void check_same(const model::Submap& a, const model::Submap& b) {
  CHECK(a.map_id == b.map_id);
  CHECK(a.id == b.id);
  CHECK(a.content_hash == b.content_hash);
  CHECK(a.payload == b.payload);
  CHECK(a.replaced == b.replaced);
  REQUIRE(a.landmarks.size() == b.landmarks.size());
  for (std::size_t i = 0; i < a.landmarks.size(); ++i) {
    const model::MapLandmark& p = a.landmarks[i];
    const model::MapLandmark& q = b.landmarks[i];
    CHECK(p.id == q.id);
    CHECK((p.position_m - q.position_m).cwiseAbs().maxCoeff() < 0.51e-4);
    const double sigma = std::sqrt(p.covariance_m2.trace());
    CHECK((p.covariance_m2 - q.covariance_m2).cwiseAbs().maxCoeff() < 4e-5 * sigma + 1e-9);
    CHECK(std::abs(p.radius_m - q.radius_m) < 0.51e-4);
    CHECK(p.observation_count == q.observation_count);
    CHECK(p.kind == q.kind);
  }
  REQUIRE(a.keyframes.size() == b.keyframes.size());
  for (std::size_t i = 0; i < a.keyframes.size(); ++i) {
    CHECK(a.keyframes[i].keyframe_sequence == b.keyframes[i].keyframe_sequence);
    CHECK(a.keyframes[i].utime == b.keyframes[i].utime);
    CHECK(a.keyframes[i].map_T_vehicle.coordinates() == b.keyframes[i].map_T_vehicle.coordinates());
    CHECK(a.keyframes[i].covariance == b.keyframes[i].covariance);
  }
}

/// What the existence tracker says of these landmarks of a map, ids ascending: each has `state`,
/// and a probability that follows from the stamp.
inline model::ExistenceState existence_state(std::uint32_t map_id, model::Utime utime,
                                             const std::vector<model::LandmarkId>& ids,
                                             const std::string& state) {
  model::ExistenceState message;
  message.utime = utime;
  message.map_id = map_id;
  message.model = "model " + state;
  for (const model::LandmarkId id : ids) {
    message.landmarks.push_back({id, static_cast<double>(utime % 1000) / 1000.0, utime % 2 == 0});
    message.states += state;
  }
  return message;
}

/// The store on a bus, with its files in `folder` (empty: as in a replay), and what it says.
class StoreOnBus {
 public:
  explicit StoreOnBus(const std::filesystem::path& folder, const std::string& more_toml = "")
      : bus_(bus::MemoryBus::Queues::kUnlimited,
             [this](const bus::BusMessage& message) { hear(message); }),
        hosted_(submap_store::submap_store_service(), bus_,
                {[this] { return computer_us_; }, [this] { return computer_us_; }}, more_toml,
                "submap_store.toml") {
    if (!folder.empty()) {
      auto& device = dynamic_cast<bus::Device&>(hosted_.adapter());
      device.set_state_directory(folder);
      device.open();
    }
    hosted_.node().connect();
  }

  /// Sends a message as its process does, numbered.
  template <class T>
  void send(const std::string& channel, const T& message) {
    auto sent = wire::to_wire(message);
    sent.seq = sequences_[channel]++;
    bus_.publish(channel, wire::encode_bytes(sent));
    bus_.drain();
  }
  void finish() { hosted_.adapter().finish(); }
  std::string save() { return hosted_.adapter().save(); }
  void load(const std::string& state) { hosted_.adapter().load(state); }
  /// The reason of a condition that holds; empty where none does.
  std::string shown() {
    computer_us_ += 10'000'000;  // What was only counted is not fresh any more.
    const health_t health = hosted_.node().health();
    return health.state == health_t::STATE_OK ? "" : health.last_error_code;
  }

  /// How many messages of a channel were refused.
  std::uint64_t refused(const std::string& channel) {
    return hosted_.node().monitor().count_of(channel, wire::Reason::kInputRefused);
  }

  std::vector<model::SubmapStored> stored;
  std::vector<model::Submap> replies;
  int map_requests = 0;
  std::vector<std::uint8_t> said;  ///< All bytes of the outputs.

 private:
  void hear(const bus::BusMessage& message) {
    if (message.channel == "SUBMAP_STORED") {
      stored.push_back(wire::decode_message<model::SubmapStored>(message.bytes).value());
    } else if (message.channel == "SUBMAP_REPLY") {
      replies.push_back(wire::decode_message<model::Submap>(message.bytes).value());
    } else if (message.channel == "MAP_REQUEST") {
      ++map_requests;
    } else {
      return;
    }
    said.insert(said.end(), message.bytes.begin(), message.bytes.end());
  }

  std::int64_t computer_us_ = 1'000'000'000;
  std::map<std::string, std::int64_t> sequences_;
  bus::MemoryBus bus_;
  bus::HostedService hosted_;
};

inline model::SubmapQuery query_for(std::uint32_t map_id, std::vector<model::SubmapId> ids,
                                    model::Utime utime) {
  return {utime, 0, map_id, std::move(ids)};
}

}  // namespace understory::test
