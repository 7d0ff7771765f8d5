// Mapper and tracker on one bus: a given map of which some trees are gone.
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <set>

#include "common/bus/memory_bus.hpp"
#include "common/wire/convert.hpp"
#include "services/existence_tracker/adapter.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "tests/catch.hpp"
#include "understory/health_t.hpp"

using namespace understory;

namespace {

constexpr double kRangeM = 18.0;
constexpr const char* kMapperToml =
    "[smoothing]\nuse_odometry = true\nmin_observations = 1\nmin_observation_ratio = 0.0\n";
constexpr const char* kTrackerToml = "[model]\nrange_m = 18.0\n[looks]\npass_m = 180.0\n";
constexpr int kLap = 95;

/// A ring road of 188 m among trees, driven lap after lap.
class Forest {
 public:
  explicit Forest(std::uint64_t seed) : random_(seed) {
    std::uniform_real_distribution<double> across(-50.0, 50.0);
    while (trees_m_.size() < 160) {
      const Eigen::Vector2d tree_m(across(random_), across(random_));
      if (std::abs(tree_m.norm() - 30.0) > 3.0) trees_m_.push_back(tree_m);
    }
  }
  geometry::SE2 pose(int k) const {
    const double angle = k * 2.0 / 30.0;
    return {30.0 * std::cos(angle), 30.0 * std::sin(angle), angle + 0.5 * M_PI};
  }
  /// A lap a day: what was seen a minute ago is not gone.
  static model::Utime utime(int k) {
    return 1'000'000 * (static_cast<model::Utime>(k) + 1 + 86'400 * (k / kLap));
  }

  model::Odometry odometry_to(int k) {
    model::Odometry motion;
    motion.from_utime = utime(k - 1);
    motion.utime = utime(k);
    motion.sequence = static_cast<std::uint64_t>(k);
    motion.from_T_to = pose(k - 1).inverse() * pose(k) *
                       geometry::SE2::Exp({0.01 * draw(), 0.01 * draw(), 0.002 * draw()});
    motion.covariance = Eigen::Vector3d(1e-4, 1e-4, 4e-6).asDiagonal();
    motion.has_wheels = true;
    return motion;
  }
  model::Keyframe keyframe_at(int k, const std::set<std::size_t>& gone) {
    model::Keyframe keyframe;
    keyframe.utime = utime(k);
    keyframe.sequence = static_cast<std::uint64_t>(k);
    keyframe.field_of_view.max_range_m = kRangeM;
    keyframe.members.push_back({keyframe.utime, keyframe.sequence, {}, Eigen::Matrix3d::Zero()});
    for (std::size_t i = 0; i < trees_m_.size(); ++i) {
      const Eigen::Vector2d seen_m = pose(k).inverse() * trees_m_[i];
      if (gone.contains(i) || seen_m.norm() > kRangeM) continue;
      model::KeyframeLandmark landmark;
      landmark.position_m = seen_m + 0.03 * Eigen::Vector2d(draw(), draw());
      landmark.covariance_m2 = 9e-4 * Eigen::Matrix2d::Identity();
      landmark.radius_m = 0.2;
      landmark.observation_count = 1;
      keyframe.landmarks.push_back(landmark);
    }
    return keyframe;
  }
  std::set<std::size_t> felled(double share) {
    std::set<std::size_t> ids;
    std::bernoulli_distribution falls(share);
    for (std::size_t i = 0; i < trees_m_.size(); ++i)
      if (falls(random_)) ids.insert(i);
    return ids;
  }
  /// The tree of a place in the world.
  std::optional<std::size_t> tree_at(const Eigen::Vector2d& world_m) const {
    for (std::size_t i = 0; i < trees_m_.size(); ++i)
      if ((trees_m_[i] - world_m).norm() < 0.4) return i;
    return std::nullopt;
  }

 private:
  double draw() { return normal_(random_); }
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector2d> trees_m_;
};

class Stack {
 public:
  Stack() {
    host(geoslam_mapper::geoslam_mapper_service(), kMapperToml);
    host(existence_tracker::existence_tracker_service(), kTrackerToml);
    bus_.subscribe("SLAM_UPDATE", 0, [this](const bus::BusMessage& message) {
      updates.push_back(wire::decode_message<model::MapUpdate>(message.bytes).value());
    });
    bus_.subscribe("MAP", 0, [this](const bus::BusMessage& message) {
      map = wire::decode_message<model::WholeMap>(message.bytes).value();
    });
    bus_.subscribe("EXISTENCE", 0, [this](const bus::BusMessage& message) {
      const auto one = wire::decode_message<model::Existence>(message.bytes).value();
      for (const model::LandmarkExistence& landmark : one.landmarks) held[landmark.id] = landmark;
      last = one;
    });
    bus_.subscribe("EXISTENCE_STATE", 0, [this](const bus::BusMessage& message) {
      const auto one = wire::decode_message<model::ExistenceState>(message.bytes).value();
      states += one.landmarks.size();
    });
  }
  void drive(Forest& forest, int first, int end, const std::set<std::size_t>& gone) {
    for (int k = first; k < end; ++k) {
      if (k > 0) publish("ODOMETRY", wire::encode_message(forest.odometry_to(k)));
      publish("KEYFRAME", wire::encode_message(forest.keyframe_at(k, gone)));
    }
  }
  void finish() {
    for (auto& one : hosted_) one->adapter().finish();
    bus_.drain();
  }
  /// The tracker goes on with what it saved, as after a restart.
  void restart_tracker() {
    const std::string state = hosted_.back()->adapter().save();
    hosted_.back()->adapter().load(state);
  }

  std::vector<model::MapUpdate> updates;
  model::WholeMap map;
  std::map<model::LandmarkId, model::LandmarkExistence> held;
  model::Existence last;
  std::size_t states = 0;

 private:
  void host(const bus::Service& service, const std::string& toml) {
    hosted_.push_back(std::make_unique<bus::HostedService>(service, bus_, bus::no_clock(), toml,
                                                           service.name + ".toml"));
    hosted_.back()->node().connect();
  }
  void publish(const std::string& channel, const wire::Bytes& bytes) {
    bus_.publish(channel, bytes);
    bus_.drain();
  }
  bus::MemoryBus bus_;
  std::vector<std::unique_ptr<bus::HostedService>> hosted_;
};

}  // namespace

TEST_CASE("The mapper does not use what is gone, and uses it again when it is back",
          "[existence]") {
  Forest forest(3);
  Stack stack;
  stack.drive(forest, 0, 2 * kLap, {});
  const std::set<std::size_t> gone = forest.felled(0.15);
  stack.drive(forest, 2 * kLap, 3 * kLap, gone);
  stack.restart_tracker();
  stack.drive(forest, 3 * kLap, 7 * kLap, gone);
  stack.finish();
  CHECK(stack.states > 100);

  // Who is not in use, and is it right? The map's frame is that of the first keyframe.
  std::size_t unused = 0, right = 0, felled = 0;
  for (const model::MapLandmark& landmark : stack.map.landmarks) {
    const auto tree = forest.tree_at(forest.pose(0) * landmark.position_m);
    REQUIRE(tree);
    felled += gone.contains(*tree) ? 1 : 0;
    if (stack.held.at(landmark.id).is_in_use) continue;
    ++unused;
    right += gone.contains(*tree) ? 1 : 0;
  }
  CAPTURE(unused, right, felled);
  CHECK(felled > 5);
  CHECK(right == unused);
  CHECK(right > 0.8 * static_cast<double>(felled));
  CHECK(stack.last.unused == unused);

  // They are still expected, and no pose rests on them.
  const model::MapUpdate& update = stack.updates.back();
  CHECK(update.status == model::MapUpdateStatus::kUpdated);
  std::size_t expected_unused = 0;
  for (const model::LandmarkId id : update.expected)
    expected_unused += stack.held.at(id).is_in_use ? 0 : 1;
  CHECK(expected_unused > 0);

  // They come back: named with their ids at once, and in use after the lap.
  const std::size_t landmarks = stack.map.landmarks.size();
  stack.drive(forest, 7 * kLap, 8 * kLap, {});
  stack.finish();
  CHECK(stack.last.unused == 0);
  CHECK(stack.map.landmarks.size() <= landmarks + 1);
}
