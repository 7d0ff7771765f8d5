// A vehicle that drives past landmarks again and again, and what a mapper would tell of it.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <set>
#include <vector>

#include "common/model/slam_output.hpp"

namespace understory::test {

/// Landmarks on both sides of a straight road; a keyframe every 2 m, range 20 m.
class Road {
 public:
  static constexpr double kRangeM = 20.0;
  static constexpr double kStepM = 2.0;
  static constexpr double kLengthM = 300.0;

  explicit Road(std::uint64_t seed, int landmarks = 150) : random_(seed) {
    std::uniform_real_distribution<double> along(0.0, kLengthM);
    std::uniform_real_distribution<double> aside(4.0, 16.0);
    for (int i = 0; i < landmarks; ++i)
      add({along(random_), (i % 2 == 0 ? 1.0 : -1.0) * aside(random_)});
  }
  /// One more, frame map.
  model::LandmarkId add(const Eigen::Vector2d& position_m) {
    places_m_.push_back(position_m);
    return places_m_.size();
  }
  std::size_t size() const { return places_m_.size(); }

  /// All landmarks as the mapper would tell them.
  model::WholeMap map() const {
    model::WholeMap map;
    map.complete = true;
    for (std::size_t i = 0; i < places_m_.size(); ++i) {
      model::MapLandmark one;
      one.id = i + 1;
      one.position_m = places_m_[i];
      map.landmarks.push_back(one);
    }
    return map;
  }

  /// The updates of one drive along the road. `sees(id)` decides whether a landmark in view is
  /// detected in this keyframe.
  std::vector<model::MapUpdate> drive(model::Utime begin_utime,
                                      const std::function<bool(model::LandmarkId)>& sees) {
    std::vector<model::MapUpdate> updates;
    for (double x_m = 0.0; x_m < kLengthM; x_m += kStepM) {
      model::MapUpdate update;
      update.status = model::MapUpdateStatus::kUpdated;
      update.keyframe_sequence = sequence_++;
      update.utime = begin_utime + static_cast<model::Utime>(x_m * 1e6);
      update.map_T_vehicle = {x_m, 0.0, 0.0};
      for (std::size_t i = 0; i < places_m_.size(); ++i) {
        const model::LandmarkId id = i + 1;
        if ((places_m_[i] - Eigen::Vector2d(x_m, 0.0)).norm() > kRangeM) continue;
        if (sees(id)) {
          update.associations.push_back(
              {static_cast<std::uint32_t>(update.associations.size()), id});
        } else {
          update.expected.push_back({id});
        }
      }
      update.inliers = static_cast<std::uint32_t>(update.associations.size());
      updates.push_back(std::move(update));
    }
    return updates;
  }
  /// True with this chance.
  bool chance(double share) { return std::bernoulli_distribution(share)(random_); }
  /// Each landmark with this chance.
  std::set<model::LandmarkId> draw(double share) {
    std::set<model::LandmarkId> ids;
    for (std::size_t i = 1; i <= places_m_.size(); ++i)
      if (chance(share)) ids.insert(i);
    return ids;
  }

 private:
  std::mt19937_64 random_;
  std::vector<Eigen::Vector2d> places_m_;
  std::uint64_t sequence_ = 0;
};

}  // namespace understory::test
