// The project's mapper: gated association around a prediction, search where that fails, all
// keyframes and landmarks in one graph. Who is lost begins another map.
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

/// The global map: localises keyframes in it, grows it and keeps it consistent (GeoSLAM §4.3,
/// algorithms 3-5). Poses are of `vehicle_level` in the frame `map`. It decides which map a
/// keyframe belongs to. One map is in use. Where it cannot place a keyframe, and odometry does not
/// reach there from the last one that it placed, the vehicle is lost: then a trial map is begun
/// beside it. Once `new_map_keyframes` successive keyframes agree in the trial, it is the map in
/// use, and the other one is kept as it is, until keyframes are found in it again: then it becomes
/// part of the map in use, in its frame (GeoSLAM §7.2.3). A map in use with which fewer keyframes
/// agree is provisional: it gives way to a trial that does better, and is dropped (GeoSLAM §7.2:
/// one bad scan must not be the map).
class SmoothingMapper {
 public:
  /// An empty map.
  explicit SmoothingMapper(const SmoothingMapperParameters& parameters);

  /// Localises the keyframe and fuses it. The map changes only with the statuses kFirstMap and
  /// kUpdated; for the others `reason` states why. Throws nothing on bad data.
  model::MapUpdate add(const model::Keyframe& keyframe);
  /// Pose of a single scan between keyframes. The map is not changed. Where too few detections
  /// match it is by odometry, as long as there is any. None where there is no map yet, or where
  /// odometry has a gap.
  std::optional<ScanPose> locate(const model::LandmarkScan& scan);
  /// Motion without landmarks; becomes a factor between keyframes where the configuration asks for
  /// it.
  void add(const model::Odometry& odometry) { add_to_all(odometry); }
  /// The filter's pose: a keyframe with few landmarks that contradicts its motion is refused. Never
  /// a measurement: the filter uses the same detections.
  void add(const model::EkfPose& pose) { add_to_all(pose); }
  /// The filter's estimate of the level error; single scans are levelled by it.
  void add(const model::EkfLevel& level) { add_to_all(level); }
  /// What the vehicle's motion showed of the level at its last rest: where the map began at it, the
  /// map's origin is where it truly was.
  void add(const model::RestLevel& level) { add_to_all(level); }
  /// A map to start from (GeoSLAM §4.3.1), frame `map`; call it before the first keyframe.
  void start_with(std::span<const model::MapLandmark> landmarks) { current_.start_with(landmarks); }
  /// An empty map begins with this number; call it before everything else.
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
  /// Those landmarks that are new or have moved since the last call, and all around the vehicle
  /// (kAroundVehicle_m), in order of id and without covariances; costs what it gives.
  std::vector<model::MapLandmark> take_changed_landmarks();
  /// Sets the covariances of these landmarks of the map. Costs the part of the graph between them
  /// and its root.
  void set_covariances(std::span<model::MapLandmark> landmarks) const {
    current_.set_covariances(landmarks);
  }

  /// Whether parts of the map may be given away; without a call they may, where the configuration
  /// says so.
  void may_hand_over(bool may) { may_hand_over_ = may; }
  /// Parts of maps that were given away since the last call: the caller keeps them. Their
  /// landmarks and keyframes are in landmarks(), trajectory() and changes no more.
  std::vector<model::Submap> take_given_away() {
    return units_.metres(std::exchange(given_away_, {}));
  }
  /// Submaps that are wanted back: the vehicle comes near them.
  std::vector<model::SubmapId> wanted() const { return current_.submaps().wanted(); }
  /// Puts a submap back. Returns why not, where it is not away or not as it was; empty otherwise.
  std::string bring_back(const model::Submap& submap) { return current_.bring_back(submap); }
  /// Where the submaps are that were ever given away, in order of id. O(submaps).
  std::vector<model::SubmapPose> submap_poses() const {
    return units_.metres(current_.submaps().poses(current_.map().graph));
  }

  /// Takes a loop closure of the map in use, or takes one back; the answer says what became of it.
  model::LoopResult take(const model::LoopClosure& closure);
  /// Which landmarks are taken for gone: they are kept, but nothing is placed by them. Those that
  /// the map does not have are passed over.
  void take(const model::Existence& existence);
  /// From now on the factors of each stretch of the path that is condensed are kept until they are
  /// taken: an expand() of them is the drive uncut. See Condensing.
  void keep_stretches() { current_.keep_stretches(); }
  /// Those of the map in use since the last call.
  std::vector<Stretch> take_stretches() { return current_.take_stretches(); }
  /// The map in use.
  const OneMap& current() const { return current_; }
  /// The maps that were left.
  const MapArchive& kept_maps() const { return kept_maps_; }

  /// The whole state, for a restart. O(state).
  std::string save() const;
  /// Continues from what save() gave. Throws std::invalid_argument on other bytes; the state is
  /// then as it was.
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
  /// What every map needs to know.
  template <class Message>
  void add_to_all(const Message& message) {
    current_.add(message);
    if (trial_) trial_->add(message);
  }

  SmoothingMapperParameters parameters_;
  OneMap current_;
  std::unique_ptr<OneMap> trial_;  ///< Null where the vehicle is not lost.
  MapArchive kept_maps_;
  Rejoining rejoining_;
  MapUnits units_;
  std::optional<model::Utime> last_utime_;  ///< Of the last well-formed keyframe.
  std::uint32_t contradictions_ = 0;        ///< Keyframes rolled back since the last one accepted.
  bool may_hand_over_ = true;
  std::vector<model::Submap> given_away_;  ///< Since they were taken.
};

}  // namespace understory::geoslam_mapper::smoothing
