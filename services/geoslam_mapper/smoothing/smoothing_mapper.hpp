// The project's mapper: gated association around a prediction, search where that fails, all
// keyframes and landmarks in one graph. Who is lost begins another map.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "services/geoslam_mapper/smoothing/map_archive.hpp"
#include "services/geoslam_mapper/smoothing/map_units.hpp"
#include "services/geoslam_mapper/smoothing/one_map.hpp"

namespace understory::geoslam_mapper::smoothing {

/// Which map a keyframe belongs to. One map is in use. Where it cannot place a keyframe, and
/// odometry does not reach there from the last one that it placed, the vehicle is lost: then a
/// trial map is begun beside it. Once `new_map_keyframes` successive keyframes agree in the trial,
/// it is the map in use, and the other one is kept as it is, until keyframes are found in it again:
/// then it becomes part of the map in use, in its frame (GeoSLAM §7.2.3). A map in use with which
/// fewer keyframes agree is provisional: it gives way to a trial that does better, and is dropped
/// (GeoSLAM §7.2: one bad scan must not be the map). See MapperMethod for the functions.
class SmoothingMapper final : public MapperMethod {
 public:
  /// An empty map.
  explicit SmoothingMapper(const SmoothingMapperParameters& parameters);

  model::MapUpdate add(const model::Keyframe& keyframe) override;
  bool locates_scans() const override { return true; }
  std::optional<ScanPose> locate(const model::LandmarkScan& scan) override;
  void add(const model::Odometry& odometry) override { add_to_all(odometry); }
  void add(const model::EkfPose& pose) override { add_to_all(pose); }
  void add(const model::EkfLevel& level) override { add_to_all(level); }
  void add(const model::RestLevel& level) override { add_to_all(level); }
  void start_with(std::span<const model::MapLandmark> landmarks) override {
    current_.start_with(landmarks);
  }

  void begin_with_number(std::uint32_t map_id) override { current_ = OneMap(parameters_, map_id); }

  std::vector<model::KeyframePose> trajectory() const override {
    return units_.metres(current_.told_poses());
  }
  std::vector<model::MapLandmark> landmarks() const override {
    return units_.metres(current_.told_landmarks());
  }
  std::optional<std::vector<model::MapLandmark>> take_changed_landmarks() override;
  void set_covariances(std::span<model::MapLandmark> landmarks) const override {
    current_.set_covariances(landmarks);
  }
  void may_hand_over(bool may) override { may_hand_over_ = may; }
  std::vector<model::Submap> take_given_away() override {
    return units_.metres(std::exchange(given_away_, {}));
  }
  std::vector<model::SubmapId> wanted() const override { return current_.submaps().wanted(); }
  std::string bring_back(const model::Submap& submap) override {
    return current_.bring_back(submap);
  }
  std::vector<model::SubmapPose> submap_poses() const override {
    return units_.metres(current_.submaps().poses(current_.map().graph));
  }
  model::LoopResult take(const model::LoopClosure& closure) override;
  void take(const model::Existence& existence) override;
  /// From now on the factors of each stretch of the path that is condensed are kept until they are
  /// taken: an expand() of them is the drive uncut. See Condensing.
  void keep_stretches() { current_.keep_stretches(); }
  /// Those of the map in use since the last call.
  std::vector<Stretch> take_stretches() { return current_.take_stretches(); }
  /// The map in use.
  const OneMap& current() const { return current_; }
  /// The maps that were left.
  const MapArchive& kept_maps() const { return kept_maps_; }

  std::string save() const override;
  void load(const std::string& state) override;

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

/// A SmoothingMapper with an empty map.
std::unique_ptr<MapperMethod> make_smoothing_mapper(const SmoothingMapperParameters& parameters);

}  // namespace understory::geoslam_mapper::smoothing
