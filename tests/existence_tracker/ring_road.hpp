// Mapper and tracker on one bus, and a ring road among trees that they are driven round.
#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>

#include "common/bus/memory_bus.hpp"
#include "common/model/view_ranges.hpp"
#include "common/wire/convert.hpp"
#include "services/existence_tracker/adapter.hpp"
#include "services/geoslam_mapper/adapter.hpp"
#include "tests/catch.hpp"

namespace understory::test {

inline constexpr double kRangeM = 18.0;
inline constexpr const char* kMapperToml =
    "[smoothing]\nuse_odometry = true\nmin_observations = 1\nmin_observation_ratio = 0.0\n";
inline constexpr const char* kTrackerToml = "[model]\nrange_m = 18.0\n[looks]\npass_m = 189.9\n";
inline constexpr int kLap = 95;

/// What is different on a lap.
struct Lap {
  std::set<std::size_t> gone = {};    ///< Trees.
  std::set<std::size_t> missed = {};  ///< Trees that stand and are not detected.
  bool has_lorries = false;           ///< Along an eighth of the road, at its outer side.
  bool has_ranges = true;             ///< Each keyframe comes with how far its scan saw.
  double false_share = 0.0;           ///< Of the landmarks of a keyframe.
};

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
  /// Whether lorries stand between a place of the world and the vehicle.
  bool is_behind_lorries(int k, const Eigen::Vector2d& world_m) const {
    return world_m.norm() > kLorries_m && is_at_lorries(k, world_m - pose(k).translation());
  }
  /// Where no lorry, tree or thing is, one sees as far as this [m].
  static constexpr double kFarM = 60.0;
  model::ViewRanges view_at(int k, const Lap& lap) const {
    model::ViewRanges view;
    view.utime = utime(k);
    view.sequence = static_cast<std::uint64_t>(k);
    view.step_rad = 2.0 * M_PI / 720;
    view.beam_step_rad = 0.003;
    for (int bin = 0; bin < 720; ++bin) {
      const double bearing = pose(k).theta() + (bin + 0.5) * view.step_rad;
      const double nearest_m = nearest_along(k, {std::cos(bearing), std::sin(bearing)}, lap);
      view.free.push_back(static_cast<std::uint8_t>(nearest_m / view.range_step_m));
      view.hidden.push_back(nearest_m < kFarM ? view.free.back() + 1 : 0);
    }
    return view;
  }
  model::Keyframe keyframe_at(int k, const Lap& lap) {
    model::Keyframe keyframe;
    keyframe.utime = utime(k);
    keyframe.sequence = static_cast<std::uint64_t>(k);
    keyframe.field_of_view.max_range_m = kRangeM;
    keyframe.members.push_back({keyframe.utime, keyframe.sequence, {}, Eigen::Matrix3d::Zero()});
    for (std::size_t i = 0; i < trees_m_.size(); ++i) {
      const Eigen::Vector2d seen_m = pose(k).inverse() * trees_m_[i];
      if (lap.gone.contains(i) || lap.missed.contains(i) || seen_m.norm() > kRangeM) continue;
      if (lap.has_lorries && is_behind_lorries(k, trees_m_[i])) continue;
      keyframe.landmarks.push_back(landmark_at(seen_m));
    }
    add_false(k, lap.false_share, keyframe);
    return keyframe;
  }
  std::size_t size() const { return trees_m_.size(); }
  const Eigen::Vector2d& tree(std::size_t i) const { return trees_m_[i]; }
  /// Whether the road passes within range of a tree.
  bool is_beside_road(std::size_t i) const {
    return std::abs(trees_m_[i].norm() - 30.0) < kRangeM - 2.0;
  }
  /// Whether lorries hide it from wherever it is in range.
  bool is_hidden(std::size_t i) const {
    if (!is_beside_road(i)) return false;
    for (int k = 0; k < kLap; ++k)
      if ((trees_m_[i] - pose(k).translation()).norm() < kRangeM &&
          !is_behind_lorries(k, trees_m_[i]))
        return false;
    return true;
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
  static constexpr double kLorries_m = 32.0;  ///< Radius of the arc on which they stand.
  static constexpr double kTree_m = 0.2;

  /// Something that is no landmark, and stands for a few keyframes.
  struct Ghost {
    Eigen::Vector2d world_m;
    int until;
  };

  double draw() { return normal_(random_); }
  /// Distance to the arc of the lorries along a direction, from within; 0 = it passes them by.
  static double to_lorries(const Eigen::Vector2d& from_m, const Eigen::Vector2d& direction) {
    const double along = from_m.dot(direction);
    const double away = kLorries_m * kLorries_m - from_m.squaredNorm();
    const double range_m = -along + std::sqrt(along * along + away);
    const Eigen::Vector2d at_m = from_m + range_m * direction;
    const double angle = std::atan2(at_m.y(), at_m.x());
    return angle > 1.0 && angle < 1.0 + M_PI / 4.0 ? range_m : 0.0;
  }
  bool is_at_lorries(int k, const Eigen::Vector2d& offset_m) const {
    return to_lorries(pose(k).translation(), offset_m.normalized()) > 0.0;
  }
  double nearest_along(int k, const Eigen::Vector2d& direction, const Lap& lap) const {
    const Eigen::Vector2d from_m = pose(k).translation();
    double nearest_m = kFarM;
    if (const double lorry_m = to_lorries(from_m, direction); lap.has_lorries && lorry_m > 0.0)
      nearest_m = lorry_m;
    const auto meet = [&](const Eigen::Vector2d& world_m) {
      const Eigen::Vector2d offset_m = world_m - from_m;
      const double along_m = offset_m.dot(direction);
      if (along_m < 0.0 || offset_m.squaredNorm() - along_m * along_m > kTree_m * kTree_m) return;
      nearest_m = std::min(nearest_m, along_m);
    };
    for (std::size_t i = 0; i < trees_m_.size(); ++i)
      if (!lap.gone.contains(i)) meet(trees_m_[i]);
    for (const Ghost& ghost : ghosts_) meet(ghost.world_m);
    return nearest_m;
  }
  model::KeyframeLandmark landmark_at(const Eigen::Vector2d& seen_m) {
    model::KeyframeLandmark landmark;
    landmark.position_m = seen_m + 0.03 * Eigen::Vector2d(draw(), draw());
    landmark.covariance_m2 = 9e-4 * Eigen::Matrix2d::Identity();
    landmark.radius_m = kTree_m;
    landmark.observation_count = 1;
    return landmark;
  }
  /// Half of them are in one keyframe alone, half stand for one to five.
  void add_false(int k, double share, model::Keyframe& keyframe) {
    if (share <= 0.0) return;
    const double wanted = static_cast<double>(keyframe.landmarks.size()) * share / (1.0 - share);
    std::uniform_real_distribution<double> across(-kRangeM, kRangeM);
    const auto somewhere = [&] {
      return Eigen::Vector2d(0.7 * across(random_), 0.7 * across(random_));
    };
    for (int i = std::poisson_distribution<int>(0.5 * wanted)(random_); i > 0; --i)
      keyframe.landmarks.push_back(landmark_at(somewhere()));
    for (int i = std::poisson_distribution<int>(0.5 * wanted / 3.0)(random_); i > 0; --i)
      ghosts_.push_back(
          {pose(k) * somewhere(), k + std::uniform_int_distribution<int>(0, 4)(random_)});
    std::erase_if(ghosts_, [&](const Ghost& ghost) { return ghost.until < k; });
    for (const Ghost& ghost : ghosts_)
      keyframe.landmarks.push_back(landmark_at(pose(k).inverse() * ghost.world_m));
  }

  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector2d> trees_m_;
  std::vector<Ghost> ghosts_;
};

class Stack {
 public:
  explicit Stack(const std::string& more_of_tracker = "") {
    host(geoslam_mapper::geoslam_mapper_service(), kMapperToml);
    host(existence_tracker::existence_tracker_service(), kTrackerToml + more_of_tracker);
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
  void drive(Forest& forest, int first, int end, const Lap& lap) {
    for (int k = first; k < end; ++k) {
      if (k > 0) publish("ODOMETRY", wire::encode_message(forest.odometry_to(k)));
      const model::Keyframe keyframe = forest.keyframe_at(k, lap);
      if (lap.has_ranges) publish("VIEW_RANGES", wire::encode_message(forest.view_at(k, lap)));
      publish("KEYFRAME", wire::encode_message(keyframe));
    }
  }
  void drive_laps(Forest& forest, int first, int end, const Lap& lap) {
    drive(forest, first * kLap, end * kLap, lap);
  }
  /// Landmarks of trees by whether they are in use, those of no tree, and each tree's id.
  struct Count {
    std::set<std::size_t> in_use, unused;
    std::size_t false_in_use = 0;
    std::map<std::size_t, model::LandmarkId> ids;
  };
  Count count(const Forest& forest) const {
    Count result;
    for (const model::MapLandmark& landmark : map.landmarks) {
      const auto tree = forest.tree_at(forest.pose(0) * landmark.position_m);
      const auto found = held.find(landmark.id);
      const bool is_in_use = found == held.end() || found->second.is_in_use;
      if (!tree) {
        result.false_in_use += is_in_use ? 1 : 0;
        continue;
      }
      (is_in_use ? result.in_use : result.unused).insert(*tree);
      result.ids[*tree] = landmark.id;
    }
    return result;
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

}  // namespace understory::test
