// The map from the mapper's messages: landmarks, keyframes, submaps that were handed over.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "common/model/existence.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "services/viewer/keyframe_path.hpp"
#include "services/viewer/landmark_table.hpp"
#include "services/viewer/submap_places.hpp"

namespace understory::viewer {

/// Follows MAP, MAP_DELTA, EXISTENCE, SUBMAP and MAP_CORRECTION.
class ShownMap {
 public:
  /// `changes` is the scene's counter and must outlive it.
  explicit ShownMap(Change& changes)
      : changes_(&changes), landmarks_(changes), keyframes_(changes) {}

  /// Another map begins, or none is known (0).
  void start(std::uint32_t id);
  /// Sets the number of the present map.
  void set_id(std::uint32_t id) { id_ = id; }
  /// Its number; 0 = unknown.
  std::uint32_t id() const { return id_; }
  /// Whether the whole map must be requested: none was received, or changes were missed.
  bool wants_whole() const { return wants_whole_; }
  /// Marks the map as incomplete.
  void want_whole() { wants_whole_ = true; }
  /// Whether this delta begins the map anew: call start() before take().
  bool is_restarted_by(const model::MapDelta& delta) const {
    return delta.base_version == 0 && version_ != 0;
  }

  /// MAP, if it is complete.
  void take(const model::WholeMap& map);
  /// MAP_DELTA; a known one is ignored.
  void take(const model::MapDelta& delta);
  /// EXISTENCE.
  void take(const model::Existence& existence);
  /// SUBMAP.
  void take(const model::Submap& submap);
  /// MAP_CORRECTION.
  void take(const model::MapCorrection& correction);
  /// Adds a localised keyframe.
  void take(const model::KeyframePose& keyframe) { keyframes_.take({&keyframe, 1}); }
  /// Landmarks and keyframes of a stored map, without a mapper.
  void take_stored(std::span<const model::MapLandmark> landmarks,
                   std::span<const model::LandmarkExistence> existence,
                   std::span<const model::KeyframePose> keyframes);

  const LandmarkTable& landmarks() const { return landmarks_; }
  const Track& keyframes() const { return keyframes_.track(); }
  const SubmapPlaces& submaps() const { return submaps_; }
  /// Number of the latest change of the submaps.
  Change submaps_change() const { return submaps_change_; }
  /// Position of an end of a closure; none if it is unknown.
  std::optional<Eigen::Vector2d> place_of(const model::LoopEnd& end) const;

 private:
  void move_keyframes(const model::MapCorrection& correction);

  Change* changes_;
  std::uint32_t id_ = 0;
  std::uint64_t version_ = 0;
  bool wants_whole_ = true;
  LandmarkTable landmarks_;
  KeyframePath keyframes_;
  SubmapPlaces submaps_;
  std::map<model::SubmapId, std::vector<model::KeyframePose>> handed_over_;
  Change submaps_change_ = 0;
};

}  // namespace understory::viewer
