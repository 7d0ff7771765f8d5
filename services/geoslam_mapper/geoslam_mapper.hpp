// The global map: localises keyframes in it, grows it, keeps it consistent (GeoSLAM §4.3,
// algorithms 3-5).
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/map.hpp"
#include "common/model/odometry.hpp"
#include "services/geoslam_mapper/parameters.hpp"

namespace understory::geoslam_mapper {

/// A method of mapping. Two exist: `source` as the thesis describes it, `ours`.
class MapperMethod {
 public:
  virtual ~MapperMethod() = default;
  /// Localises the keyframe and fuses it; the map is unchanged unless the status says otherwise.
  virtual model::MapUpdate add(const model::Keyframe& keyframe) = 0;
  /// Where the vehicle is at a scan, between keyframes: the map is not changed. None where the
  /// method does not offer it, or the scan does not fit the map well enough to be sure.
  virtual std::optional<geometry::SE2WithCovariance> locate(const model::LandmarkScan& /*scan*/) {
    return std::nullopt;
  }
  /// Motion without landmarks; a factor between keyframes when the configuration says so.
  virtual void add(const model::Odometry& odometry) = 0;
  /// What the filter says: odometry that comes later is turned by its bias, and a keyframe with few
  /// landmarks that moves otherwise is not believed.
  virtual void add(const model::EkfPose& /*pose*/) {}
  /// The error of the level as the filter knows it: scans are located as levelled by it.
  virtual void add(const model::EkfLevel& /*level*/) {}
  /// A map to start from (thesis §4.3.1), frame `map`; before the first keyframe.
  virtual void start_with(std::span<const model::MapLandmark> landmarks) = 0;

  /// Every keyframe's pose as now estimated, in order of time (folded ones reconstructed).
  virtual std::vector<model::KeyframePose> trajectory() const = 0;
  /// Every landmark of the map as now estimated, in order of id.
  virtual std::vector<model::MapLandmark> landmarks() const = 0;
  /// Those of them that are new or have moved since the last call, in order of id: costs what
  /// changed. None where the method keeps no account.
  virtual std::optional<std::vector<model::MapLandmark>> take_changed_landmarks() {
    return std::nullopt;
  }

  /// The whole state, for a restart; load() takes what save() of the same method gave.
  virtual std::string save() const = 0;
  virtual void load(const std::string& state) = 0;
};

/// The method that `parameters.method` names.
std::unique_ptr<MapperMethod> make_mapper(const MapperParameters& parameters);

}  // namespace understory::geoslam_mapper
