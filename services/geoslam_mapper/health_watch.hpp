// HEALTH of the mapper, beside faults of single messages.
#pragma once

#include <array>
#include <optional>

#include "common/bus/condition.hpp"
#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/submap.hpp"
#include "services/geoslam_mapper/smoothing/filter_track.hpp"

namespace understory::geoslam_mapper {

/// Limits of the mapper's health conditions. Ranges and meanings: describe().
struct HealthParameters {
  double innovation_sigmas = 4.0;  ///< Of a keyframe's chi^2, as a normal deviate.
  double filter_disagreement_m =
      0.5;  ///< Between the motions of two keyframes in the map and in the filter.
  bus::ConditionLimits lost{8, 4};
  bus::ConditionLimits rolled_back{8, 2};
  bus::ConditionLimits diverged{8, 3};
  bus::ConditionLimits refused{8, 3};
  bus::ConditionLimits new_map{32, 1};
  bus::ConditionLimits coasting{60, 45};
};
/// Adds the parameters to the table.
void describe(HealthParameters& parameters, bus::ParameterTable& table);

/// The last keyframe that was localised.
struct CertainKeyframe {
  model::Utime utime = 0;
  geometry::SE2 map_T_vehicle;

  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.utime, s.map_T_vehicle);
  }
};

/// Derives the mapper's health from its latest keyframes. `lost`: no keyframe is localised; also:
/// few landmarks match, place recognition finds no other place, and only odometry places keyframes,
/// or scans for long. `rolled_back`: keyframes contradict the map. `diverged`: they fit the map
/// worse than stated (if the map is as stated: one keyframe in 1000 by chance, 3 of 8 once in
/// 10^7); or the motion in the map differs from the filter's, which uses the same detections; or a
/// loop closure contradicts the graph and waits, or has overruled the graph (for 50 keyframes).
/// `input_refused`: keyframes are malformed or late. `new_map`: another map was begun some
/// keyframes ago. `not_stored`: no store confirms submaps that were handed over.
class HealthWatch {
 public:
  /// No condition is raised.
  explicit HealthWatch(const HealthParameters& parameters = {});

  /// A map was given: until a keyframe is localised in it, a single keyframe that is not localised
  /// raises `lost`.
  void must_find_map() { must_find_map_ = true; }
  /// The result of a keyframe.
  void add(const model::MapUpdate& update);
  /// A scan between keyframes; `is_coasting`: only odometry gave its pose.
  void add_scan(bool is_coasting) { coasting_.condition.add(is_coasting); }
  /// The result of a loop closure.
  void add(const model::LoopResult& result);
  /// The filter's pose, to compare motions.
  void add(const model::EkfPose& pose) { filter_.add(pose); }
  /// Whether a store confirms the submaps; call it after each keyframe.
  void keeps_up(bool does) { not_stored_.condition.add(!does); }
  /// The conditions for HEALTH.
  std::array<bus::WatchedCondition, 10> conditions() const {
    return {lost_,    unconfirmed_, rolled_back_, diverged_,   contradicts_,
            closure_, refused_,     new_map_,     not_stored_, coasting_};
  }

  /// Members of a saved state; see common/state. The parameters are configuration, and scans are in
  /// no journal.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.lost_, self.unconfirmed_, self.rolled_back_, self.diverged_, self.contradicts_,
      self.closure_, self.refused_, self.new_map_, self.not_stored_, self.filter_, self.last_,
      self.map_id_, self.must_find_map_, self.doubtful_keyframes_);
  }

 private:
  void compare(const model::MapUpdate& update);

  HealthParameters parameters_;
  bus::WatchedCondition lost_;
  bus::WatchedCondition unconfirmed_;
  bus::WatchedCondition rolled_back_;
  bus::WatchedCondition diverged_;
  bus::WatchedCondition contradicts_;
  bus::WatchedCondition closure_;
  bus::WatchedCondition refused_;
  bus::WatchedCondition new_map_;
  bus::WatchedCondition not_stored_;
  bus::WatchedCondition coasting_;
  smoothing::FilterTrack filter_;
  std::optional<CertainKeyframe> last_;
  std::uint32_t map_id_ = 0;  ///< 0 before the first keyframe.
  bool must_find_map_ = false;
  int doubtful_keyframes_ =
      0;  ///< Number of keyframes to come, after a loop closure contradicted the graph.
};

}  // namespace understory::geoslam_mapper
