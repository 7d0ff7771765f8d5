// One map: processing of a keyframe in it, from arrival to result.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/existence.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "common/model/submap.hpp"
#include "services/geoslam_mapper/mapper_output.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/closures.hpp"
#include "services/geoslam_mapper/smoothing/common_error.hpp"
#include "services/geoslam_mapper/smoothing/condensing.hpp"
#include "services/geoslam_mapper/smoothing/discovery.hpp"
#include "services/geoslam_mapper/smoothing/dormancy.hpp"
#include "services/geoslam_mapper/smoothing/fusion.hpp"
#include "services/geoslam_mapper/smoothing/global_map.hpp"
#include "services/geoslam_mapper/smoothing/known_ground.hpp"
#include "services/geoslam_mapper/smoothing/map_archive.hpp"
#include "services/geoslam_mapper/smoothing/merging.hpp"
#include "services/geoslam_mapper/smoothing/motion.hpp"
#include "services/geoslam_mapper/smoothing/place_recogniser.hpp"
#include "services/geoslam_mapper/smoothing/range_scale.hpp"
#include "services/geoslam_mapper/smoothing/rejoining.hpp"
#include "services/geoslam_mapper/smoothing/scan_localiser.hpp"
#include "services/geoslam_mapper/smoothing/start_level.hpp"
#include "services/geoslam_mapper/smoothing/submaps.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A map and the vehicle in it. The parts do the work. See SmoothingMapper for the functions that
/// both have; keyframes must be well-formed and in order of time.
class OneMap {
 public:
  /// An empty map. `id`: upper 16 bit of its landmarks' ids.
  explicit OneMap(const SmoothingMapperParameters& parameters, std::uint32_t id = 1);
  /// An empty map beside this one, with the same odometry, and with the vehicle not localised.
  OneMap beside(std::uint32_t id) const;

  /// Localises the keyframe and fuses it; the first one starts the map.
  model::MapUpdate add(const model::Keyframe& keyframe);
  /// The pose of a single scan.
  std::optional<ScanPose> locate(const model::LandmarkScan& scan);
  /// Motion without landmarks.
  void add(const model::Odometry& odometry);
  /// The filter's pose, as a gate.
  void add(const model::EkfPose& pose) { motion_.add(pose); }
  /// The filter's estimate of the level error.
  void add(const model::EkfLevel& level) { scan_localiser_.set(level); }
  /// Later measurement of the level at the vehicle's last rest.
  void add(const model::RestLevel& level) {
    start_level_.add(level);
    common_error_.set_start_level(start_level_.covariance());
  }
  /// A map to start from. It counts as confirmed.
  void start_with(std::span<const model::MapLandmark> landmarks);

  /// Landmarks, graph and trajectory; in units of the map, see RangeScale.
  const GlobalMap& map() const { return map_; }
  /// Metres per unit of the map: all outputs of this class are in units of the map.
  double map_factor() const { return range_scale_.map_factor(); }
  /// Whether fewer than `new_map_keyframes` keyframes agree, so that the first one may have been
  /// wrong.
  bool is_provisional() const;
  /// Whether the motion from the last localised keyframe to this one is known well enough to search
  /// for landmarks around the prediction (`lost_sigma_m`, `lost_sigma_rad`).
  bool reaches(const model::Keyframe& keyframe) const;
  /// The base of the last keyframe, localised or predicted, frame `map`; none before the first.
  const std::optional<geometry::SE2WithCovariance>& map_T_last_base() const {
    return motion_.map_T_last_base();
  }

  /// The map for output to other processes; see told_map.
  std::vector<model::MapLandmark> told_landmarks() const {
    return smoothing::told_landmarks(map_, common_error_);
  }
  /// Likewise.
  std::vector<model::KeyframePose> told_poses() const {
    return smoothing::told_poses(map_, common_error_);
  }
  /// Likewise.
  void set_covariances(std::span<model::MapLandmark> landmarks) const {
    smoothing::set_covariances(landmarks, map_, common_error_);
  }
  /// The archive entry of the map; see map_archive.
  KeptMap keep() const { return smoothing::keep(map_, common_error_); }
  /// Parts of the map that are stored elsewhere.
  const Submaps& submaps() const { return submaps_; }
  /// See Submaps::may_hand_over().
  void may_hand_over(bool may) { submaps_.may_hand_over(may); }
  /// See Submaps::take_given_away().
  std::vector<model::Submap> take_given_away() { return submaps_.take_given_away(); }
  /// See Submaps::bring_back().
  std::string bring_back(const model::Submap& submap) { return submaps_.bring_back(submap, map_); }
  /// See Condensing::keep_stretches().
  void keep_stretches() { condensing_.keep_stretches(); }
  /// See Condensing::take_stretches().
  std::vector<Stretch> take_stretches() { return condensing_.take_stretches(); }
  /// See Condensing::rest().
  Stretch rest() const { return condensing_.rest(map_); }
  /// Adds or revokes a loop closure; see Closures. A keyframe that was handed over can be an end
  /// only by its submap.
  Closures::Decision take(const model::LoopClosure& closure);
  /// Sets which landmarks are in use; ids that are not in the map are skipped.
  void take(const model::Existence& existence);
  /// Joins an earlier map to this one by their common landmarks. `update` lists the added and
  /// merged landmarks. False if the two maps contradict each other: this map is then unusable.
  /// Cost: the other map, and an update of the graph between the two.
  bool rejoin(GlobalMap left, const Overlap& overlap, model::MapUpdate& update);
  /// Landmarks that are new or have moved since the last call, and those within `around_m` of the
  /// last keyframe, in order of id.
  std::vector<model::MapLandmark> take_changed_landmarks(double around_m);

  /// Members of a saved state; see common/state. Parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.map_, self.motion_, self.discovery_, self.merging_, self.known_ground_, self.condensing_,
      self.dormancy_, self.submaps_, self.closures_, self.scan_localiser_, self.common_error_,
      self.start_level_, self.sweep_level_, self.range_scale_, self.first_offered_, self.agreeing_,
      self.lightening_.has_waited, self.lightening_.submaps_first);
  }

 private:
  /// State of lighten().
  struct Lightening {
    bool has_waited = false;     ///< Condensing made it wait at the last keyframe.
    bool submaps_first = false;  ///< Before dormancy, at the next keyframe.
  };

  bool reaches(const Prediction& prediction) const;
  void lighten(const model::Keyframe& keyframe, NodeIndex newest, bool has_condensed);
  std::string why_not_start(const model::Keyframe& keyframe);
  void level_start();
  void compare_scales(const model::Keyframe& keyframe,
                      std::span<const model::Association> associations);
  void start_map(const model::Keyframe& keyframe, model::MapUpdate& update);
  std::optional<Placement> place(const model::Keyframe& keyframe,
                                 const std::optional<Prediction>& prediction,
                                 model::MapUpdate& update);
  void extend(const FusedKeyframe& fused, std::span<const model::Association> gone,
              model::MapUpdate& update);
  std::optional<ClosureEnd> end_of(const model::LoopEnd& end) const;
  void confirm(const model::Keyframe& keyframe, model::MapUpdate& update);
  void report(const model::Keyframe& keyframe, model::MapUpdate& update);

  SmoothingMapperParameters parameters_;
  PlaceRecogniser place_recogniser_;
  GlobalMap map_;
  Motion motion_;
  Discovery discovery_;
  Merging merging_;
  KnownGround known_ground_;
  Condensing condensing_;
  Dormancy dormancy_;
  Submaps submaps_;
  Closures closures_;
  ScanLocaliser scan_localiser_;
  CommonError common_error_;
  StartLevel start_level_;
  model::SweepLevel sweep_level_;
  RangeScale range_scale_;
  std::optional<model::Utime>
      first_offered_;  ///< Time of the first keyframe that might have started the map.
  /// Number of keyframes that agree: the first, and those localised by landmarks.
  std::uint32_t agreeing_ = 0;
  Lightening lightening_;
};

}  // namespace understory::geoslam_mapper::smoothing
