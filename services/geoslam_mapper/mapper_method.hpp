// What every method of mapping offers to the service.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/existence.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "common/model/submap.hpp"

namespace understory::geoslam_mapper {

/// Where a single scan was made.
struct ScanPose {
  geometry::SE2WithCovariance map_T_vehicle;  ///< Right perturbation.
  /// By odometry alone, from the last scan or keyframe that was located: landmarks ended.
  bool is_coasting = false;
};

/// The global map: localises keyframes in it, grows it and keeps it consistent (GeoSLAM §4.3,
/// algorithms 3-5). Two methods exist: `baseline` as the thesis describes it, and `smoothing`.
/// Poses are of `vehicle_level` in the frame `map`.
class MapperMethod {
 public:
  /// Methods are owned through this interface.
  virtual ~MapperMethod() = default;

  /// Localises the keyframe and fuses it. The map changes only with the statuses kFirstMap and
  /// kUpdated; for the others `reason` states why. Throws nothing on bad data.
  virtual model::MapUpdate add(const model::Keyframe& keyframe) = 0;

  /// Whether locate() gives poses.
  virtual bool locates_scans() const { return false; }
  /// Pose of a single scan between keyframes. The map is not changed. Where too few detections
  /// match it is by odometry, as long as there is any. None where the method does not offer it,
  /// where there is no map yet, or where odometry has a gap.
  virtual std::optional<ScanPose> locate(const model::LandmarkScan& /*scan*/) {
    return std::nullopt;
  }

  /// Motion without landmarks; becomes a factor between keyframes if the configuration asks for it.
  virtual void add(const model::Odometry& odometry) = 0;

  /// The filter's pose: a keyframe with few landmarks that contradicts its motion is refused. Never
  /// a measurement: the filter uses the same detections.
  virtual void add(const model::EkfPose& /*pose*/) {}

  /// The filter's estimate of the level error; single scans are levelled by it.
  virtual void add(const model::EkfLevel& /*level*/) {}

  /// What the vehicle's motion showed of the level at its last rest: where the map began at it, the
  /// map's origin is where it truly was.
  virtual void add(const model::RestLevel& /*level*/) {}

  /// A map to start from (GeoSLAM §4.3.1), frame `map`; call it before the first keyframe.
  virtual void start_with(std::span<const model::MapLandmark> landmarks) = 0;

  /// An empty map begins with this number; call it before everything else. Methods that know one
  /// map only pass it over.
  virtual void begin_with_number(std::uint32_t /*map_id*/) {}

  /// The pose of every keyframe's base at the present estimate, in order of time; folded keyframes
  /// are reconstructed. With covariances, for about one factorisation, where the method has them.
  virtual std::vector<model::KeyframePose> trajectory() const = 0;

  /// Every landmark of the map at the present estimate, in order of id. Likewise.
  virtual std::vector<model::MapLandmark> landmarks() const = 0;

  /// Landmarks that are nearer to the vehicle than this are around it [m].
  static constexpr double kAroundVehicle_m = 60.0;

  /// Those landmarks that are new or have moved since the last call, and all around the vehicle, in
  /// order of id and without covariances; costs what it gives. None where the method does not track
  /// changes.
  virtual std::optional<std::vector<model::MapLandmark>> take_changed_landmarks() {
    return std::nullopt;
  }

  /// Sets the covariances of these landmarks of the map. Costs the part of the graph between them
  /// and its root. They stay zero where the method has none.
  virtual void set_covariances(std::span<model::MapLandmark> /*landmarks*/) const {}

  /// Whether parts of the map may be given away; without a call they may, where the configuration
  /// says so.
  virtual void may_hand_over(bool /*may*/) {}

  /// Parts of maps that were given away since the last call: the caller keeps them. Their
  /// landmarks and keyframes are in landmarks(), trajectory() and changes no more.
  virtual std::vector<model::Submap> take_given_away() { return {}; }

  /// Submaps that are wanted back: the vehicle comes near them.
  virtual std::vector<model::SubmapId> wanted() const { return {}; }

  /// Puts a submap back. Returns why not, where it is not away or not as it was; empty otherwise.
  virtual std::string bring_back(const model::Submap& /*submap*/) { return "no submap is away"; }

  /// Where the submaps are that were ever given away, in order of id. O(submaps).
  virtual std::vector<model::SubmapPose> submap_poses() const { return {}; }

  /// Which landmarks are taken for gone: they are kept, but nothing is placed by them. Those that
  /// the map does not have are passed over.
  virtual void take(const model::Existence& /*existence*/) {}

  /// Takes a loop closure of the map in use, or takes one back; the answer says what became of it.
  virtual model::LoopResult take(const model::LoopClosure& closure) {
    model::LoopResult result;
    result.map_id = closure.map_id;
    result.closure_id = closure.id;
    result.reason = "this method takes no loop closures";
    return result;
  }

  /// The whole state, for a restart. O(state).
  virtual std::string save() const = 0;

  /// Continues from what save() of the same method gave. Throws std::invalid_argument on other
  /// bytes; the state is then as it was.
  virtual void load(const std::string& state) = 0;
};

}  // namespace understory::geoslam_mapper
