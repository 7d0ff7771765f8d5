// The project's mapper: gated association around a prediction, search if that fails, all keyframes
// and landmarks in one graph. A lost vehicle begins another map.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "services/geoslam_mapper/smoothing/map_archive.hpp"
#include "services/geoslam_mapper/smoothing/map_units.hpp"
#include "services/geoslam_mapper/smoothing/one_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The global map: localises keyframes in it, extends it and keeps it consistent (GeoSLAM §4.3,
/// algorithms 3-5). Poses are of `vehicle_level` in the frame `map`. It selects the map of each
/// keyframe. One map is in use. If a keyframe cannot be localised in it, and odometry does not
/// cover the motion since the last localised keyframe, the vehicle is lost: a trial map is begun
/// beside it. Once `new_map_keyframes` successive keyframes agree in the trial, it becomes the map
/// in use. The earlier map is kept unchanged until keyframes are localised in it again: then it is
/// joined to the map in use, in the frame of that map (GeoSLAM §7.2.3). A map in use with fewer
/// agreeing keyframes is provisional: a better trial replaces it, and it is deleted (GeoSLAM §7.2:
/// one bad scan must not be the map).
class SmoothingMapper {
 public:
  /// An empty map.
  explicit SmoothingMapper(const SmoothingMapperParameters& parameters);

  /// Localises the keyframe and fuses it. The map changes only with the statuses kFirstMap and
  /// kUpdated; for the others `reason` states why. Bad data throws no exception.
  model::MapUpdate add(const model::Keyframe& keyframe);
  /// Pose of a single scan between keyframes. The map is not changed. If too few detections match,
  /// it is from odometry, as long as there is any. None before the first map, and if odometry has a
  /// gap.
  std::optional<ScanPose> locate(const model::LandmarkScan& scan);
  /// Adds motion without landmarks; it becomes a factor between keyframes if the configuration says
  /// so.
  void add(const model::Odometry& odometry) { add_to_all(odometry); }
  /// The filter's pose: a keyframe with few landmarks whose motion contradicts it is refused. Never
  /// a measurement: the filter uses the same detections.
  void add(const model::EkfPose& pose) { add_to_all(pose); }
  /// The filter's estimate of the level error; single scans are levelled by it.
  void add(const model::EkfLevel& level) { add_to_all(level); }
  /// Level error at the vehicle's last rest, estimated from its later motion: if the map began at
  /// that rest, its origin is corrected.
  void add(const model::RestLevel& level) { add_to_all(level); }
  /// A given map to start with (GeoSLAM §4.3.1), frame `map`; call it before the first keyframe.
  void start_with(std::span<const model::MapLandmark> landmarks) { current_.start_with(landmarks); }
  /// Sets the number of the empty map; call it first.
  void begin_with_number(std::uint32_t map_id) { current_ = OneMap(parameters_, map_id); }

  /// The pose of every keyframe's base at the present estimate, in order of time, with covariances;
  /// folded keyframes are reconstructed. O(one factorisation).
  std::vector<model::KeyframePose> trajectory() const {
    return units_.metres(current_.told_poses());
  }
  /// Every landmark of the map at the present estimate, in order of id. Likewise.
  std::vector<model::MapLandmark> landmarks() const {
    return units_.metres(current_.told_landmarks());
  }
  /// Landmarks that are new or have moved since the last call, and all around the vehicle
  /// (kAroundVehicle_m), in order of id and without covariances. Cost: the number returned.
  std::vector<model::MapLandmark> take_changed_landmarks();
  /// Sets the covariances of these landmarks of the map. Cost: the part of the graph between them
  /// and its root.
  void set_covariances(std::span<model::MapLandmark> landmarks) const {
    current_.set_covariances(landmarks);
  }

  /// Whether submaps may be handed over; by default they may, if the configuration says so.
  void may_hand_over(bool may) { may_hand_over_ = may; }
  /// Submaps that were handed over since the last call: the caller keeps them. Their landmarks and
  /// keyframes are no longer in landmarks(), trajectory() and take_changed_landmarks().
  std::vector<model::Submap> take_given_away() {
    return units_.metres(std::exchange(given_away_, {}));
  }
  /// Submaps to load again: the vehicle approaches them.
  std::vector<model::SubmapId> wanted() const { return current_.submaps().wanted(); }
  /// Puts a submap back. Returns the reason if it is not handed over or has changed; empty
  /// otherwise.
  std::string bring_back(const model::Submap& submap) { return current_.bring_back(submap); }
  /// Poses of all submaps ever handed over, in order of id. O(submaps).
  std::vector<model::SubmapPose> submap_poses() const {
    return units_.metres(current_.submaps().poses(current_.map().graph));
  }

  /// Adds or revokes a loop closure of the map in use; returns the result.
  model::LoopResult take(const model::LoopClosure& closure);
  /// Sets which landmarks are out of use: they are kept, but not used for localisation. Ids that
  /// are not in the map are skipped.
  void take(const model::Existence& existence);
  /// From now on the factors of each condensed stretch of the path are kept until take_stretches():
  /// expand() builds the uncut drive from them. See Condensing.
  void keep_stretches() { current_.keep_stretches(); }
  /// The stretches of the map in use since the last call.
  std::vector<Stretch> take_stretches() { return current_.take_stretches(); }
  /// The map in use.
  const OneMap& current() const { return current_; }
  /// The earlier maps.
  const MapArchive& kept_maps() const { return kept_maps_; }

  /// The whole state, for a restart. O(state).
  std::string save() const;
  /// Continues from a saved state. Throws std::invalid_argument on other bytes; the state is then
  /// unchanged.
  void load(const std::string& state);

  /// Members of a saved state; see common/state. Parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    bool has_trial = self.trial_ != nullptr;
    a(self.current_, self.kept_maps_, self.rejoining_, self.last_utime_, self.contradictions_,
      self.units_, has_trial);
    if constexpr (Archive::kReads) {
      if (has_trial) self.trial_ = std::make_unique<OneMap>(self.parameters_);
    }
    if (has_trial) a(*self.trial_);
  }

 private:
  model::MapUpdate place(const model::Keyframe& keyframe);
  std::string malformed(const model::Keyframe& keyframe) const;
  void count_contradictions(const model::MapUpdate& update);
  bool may_try_another(const model::MapUpdate& update) const;
  void try_another(const model::Keyframe& keyframe, model::MapUpdate& update);
  bool agrees(const model::Keyframe& keyframe, const model::MapUpdate& update, bool had_landmarks,
              const std::optional<geometry::SE2WithCovariance>& map_T_previous_base) const;
  void adopt_trial(model::MapUpdate& update);
  void rejoin_left_maps(const model::Keyframe& keyframe, model::MapUpdate& update);
  /// Passes a message to every map.
  template <class Message>
  void add_to_all(const Message& message) {
    current_.add(message);
    if (trial_) trial_->add(message);
  }

  SmoothingMapperParameters parameters_;
  OneMap current_;
  std::unique_ptr<OneMap> trial_;  ///< Null unless the vehicle is lost.
  MapArchive kept_maps_;
  Rejoining rejoining_;
  MapUnits units_;
  std::optional<model::Utime> last_utime_;  ///< Of the last well-formed keyframe.
  std::uint32_t contradictions_ = 0;        ///< Keyframes rolled back since the last one accepted.
  bool may_hand_over_ = true;
  std::vector<model::Submap> given_away_;  ///< Since the last take_given_away().
};

}  // namespace understory::geoslam_mapper::smoothing
