// Submaps between mapper and store, over a bus that loses messages.
#include <map>
#include <memory>

#include "common/bus/memory_bus.hpp"
#include "common/model/held_map.hpp"
#include "common/wire/convert.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "services/geoslam_mapper/hand_over.hpp"
#include "services/keyframer/adapter.hpp"
#include "sim/drive.hpp"
#include "tests/catch.hpp"
#include "understory/health_t.hpp"

using namespace understory;

namespace {

/// What happens to messages between mapper and store.
struct Losses {
  bool has_store = true;
  unsigned every = 0;     ///< One of so many messages of each kind is lost; 0: none.
  bool is_twice = false;  ///< The store says everything twice.
};

/// Keyframer and mapper on one bus, beside a store as the protocol has it.
class Stack {
 public:
  Stack(double hand_over_m, const Losses& losses) : losses_(losses) {
    host(keyframer::keyframer_service(), "");
    host(geoslam_mapper::geoslam_mapper_service(),
         "[smoothing]\ncondense_m = 10.0\nhand_over_m = " + std::to_string(hand_over_m) + "\n");
  }
  void drive(const sim::Drive& drive) {
    for (std::size_t k = 0; k < drive.size(); ++k) {
      bus_.publish("LANDMARKS", wire::encode_message(drive.scan(k).scan));
      bus_.drain();
      most_live_ = std::max(most_live_, live_landmarks());
    }
  }
  void finish() {
    for (auto& one : hosted_) one->adapter().finish();
  }

  model::WholeMap whole() const { return held_.whole().value(); }
  std::size_t most_live() const { return most_live_; }
  std::size_t stored() const { return stored_.size(); }
  int replies() const { return replies_; }
  int corrections() const { return corrections_; }

 private:
  std::size_t live_landmarks() const { return held_.map() ? held_.map()->landmarks.size() : 0; }
  void host(const bus::Service& service, const std::string& toml) {
    hosted_.push_back(std::make_unique<bus::HostedService>(service, bus_, bus::no_clock(), toml,
                                                           service.name + ".toml"));
    hosted_.back()->node().connect();
  }
  bool is_lost() { return losses_.every > 0 && ++count_ % losses_.every == 0; }
  template <class T>
  void answer(const std::string& channel, T message) {
    for (int i = 0; i < (losses_.is_twice ? 2 : 1); ++i) {
      message.sequence = sequences_[channel]++;
      if (!is_lost()) bus_.publish(channel, wire::encode_message(message));
    }
  }
  void hear(const bus::BusMessage& message) {
    if (message.channel == "MAP") {
      held_.take(wire::decode_message<model::WholeMap>(message.bytes).value());
    } else if (message.channel == "MAP_DELTA") {
      held_.take(wire::decode_message<model::MapDelta>(message.bytes).value());
    } else if (message.channel == "SLAM_UPDATE") {
      held_.take(wire::decode_message<model::MapUpdate>(message.bytes).value());
    } else if (message.channel == "MAP_CORRECTION") {
      ++corrections_;
      held_.take(wire::decode_message<model::MapCorrection>(message.bytes).value());
    } else if (message.channel == "SUBMAP") {
      store(wire::decode_message<model::Submap>(message.bytes).value());
    } else if (message.channel == "SUBMAP_QUERY") {
      reply(wire::decode_message<model::SubmapQuery>(message.bytes).value());
    }
  }
  void store(const model::Submap& submap) {
    held_.take(submap);
    if (!losses_.has_store || is_lost()) return;
    for (const model::SubmapId id : submap.replaced) stored_.erase(id);
    stored_.insert_or_assign(submap.id, submap);
    answer("SUBMAP_STORED",
           model::SubmapStored{submap.utime, 0, submap.map_id, submap.id, submap.content_hash});
  }
  void reply(const model::SubmapQuery& query) {
    if (!losses_.has_store || is_lost()) return;
    for (const model::SubmapId id : query.ids) {
      if (!stored_.contains(id)) continue;
      model::Submap submap = stored_.at(id);
      submap.utime = query.utime;
      answer("SUBMAP_REPLY", submap);
      ++replies_;
    }
  }

  Losses losses_;
  unsigned count_ = 0;
  std::size_t most_live_ = 0;
  int replies_ = 0;
  int corrections_ = 0;
  model::HeldMap held_;
  std::map<model::SubmapId, model::Submap> stored_;
  std::map<std::string, std::uint64_t> sequences_;
  bus::MemoryBus bus_{bus::MemoryBus::Queues::kUnlimited,
                      [this](const bus::BusMessage& message) { hear(message); }};
  std::vector<std::unique_ptr<bus::HostedService>> hosted_;
};

/// Two lanes, the second in sight of the first.
sim::Drive there_and_back() {
  sim::DriveParameters parameters;
  parameters.forest = sim::forest_parameters(sim::ForestKind::kIntermediate);
  parameters.path.kind = sim::PathKind::kMeander;
  parameters.path.length_m = 680.0;
  parameters.path.lane_length_m = 330.0;
  parameters.path.lane_spacing_m = 20.0;
  parameters.sensor.range_m = 20.0;
  parameters.sensor.position_sigma_m = 0.05;
  parameters.clear_the_path = true;
  return {parameters, 11};
}

}  // namespace

TEST_CASE("The whole map is there, whatever gets lost between mapper and store", "[hand_over]") {
  const sim::Drive drive = there_and_back();
  Stack all(0.0, {});
  all.drive(drive);
  all.finish();
  const model::WholeMap expected = all.whole();
  CHECK(all.stored() == 0);

  const Losses cases[] = {{true, 0, false}, {true, 3, false}, {true, 2, true}};
  for (const Losses& losses : cases) {
    Stack stack(120.0, losses);
    stack.drive(drive);
    stack.finish();
    INFO("one lost of " << losses.every);
    CHECK(stack.stored() > 3);
    CHECK(stack.replies() > 3);
    CHECK(stack.corrections() > 0);
    CHECK(stack.most_live() < 0.9 * static_cast<double>(expected.landmarks.size()));

    const model::WholeMap whole = stack.whole();
    REQUIRE(whole.landmarks.size() == expected.landmarks.size());
    REQUIRE(whole.keyframes.size() == expected.keyframes.size());
    for (std::size_t i = 0; i < whole.landmarks.size(); ++i) {
      CHECK(whole.landmarks[i].id == expected.landmarks[i].id);
      CHECK((whole.landmarks[i].position_m - expected.landmarks[i].position_m).norm() < 0.02);
      CHECK(whole.landmarks[i].observation_count == expected.landmarks[i].observation_count);
    }
    for (std::size_t i = 0; i < whole.keyframes.size(); ++i) {
      CHECK(whole.keyframes[i].keyframe_sequence == expected.keyframes[i].keyframe_sequence);
      CHECK((whole.keyframes[i].map_T_vehicle.translation() -
             expected.keyframes[i].map_T_vehicle.translation())
                .norm() < 0.02);
    }
  }
}

TEST_CASE("Without a store nothing is lost either", "[hand_over]") {
  const sim::Drive drive = there_and_back();
  Stack all(0.0, {});
  all.drive(drive);
  all.finish();
  Stack alone(120.0, {false, 0, false});
  alone.drive(drive);
  alone.finish();
  CHECK(alone.stored() == 0);
  CHECK(alone.whole().landmarks.size() == all.whole().landmarks.size());
}

TEST_CASE("What waits for the store is sent again until it has it", "[hand_over]") {
  geoslam_mapper::HandOver hand_over;
  model::Submap submap;
  submap.map_id = 2;
  for (std::size_t i = 1; i <= geoslam_mapper::HandOver::kMostWaiting; ++i) {
    CHECK(hand_over.may_hand_over());
    submap.id = i;
    submap.content_hash = 10 * i;
    hand_over.add(submap);
  }
  CHECK_FALSE(hand_over.may_hand_over());
  CHECK(hand_over.due(5'000'000).size() == geoslam_mapper::HandOver::kMostWaiting);
  CHECK(hand_over.due(5'900'000).empty());
  hand_over.confirm({0, 0, 2, 7, 71});  // Another content.
  hand_over.confirm({0, 0, 1, 7, 70});  // Another map.
  CHECK(hand_over.due(6'000'000).size() == geoslam_mapper::HandOver::kMostWaiting);
  hand_over.confirm({0, 0, 2, 7, 70});
  CHECK(hand_over.may_hand_over());
  CHECK_FALSE(hand_over.take(2, 7));
  CHECK(hand_over.take(2, 8)->content_hash == 80);
  CHECK_FALSE(hand_over.take(2, 8));

  const std::vector<model::SubmapId> wanted{4, 5};
  CHECK(hand_over.to_ask(wanted, 7'000'000) == wanted);
  CHECK(hand_over.to_ask(wanted, 7'500'000).empty());
  CHECK(hand_over.to_ask(wanted, 8'000'000) == wanted);
}
