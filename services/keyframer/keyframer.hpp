// Local bundle adjustment: n scans -> one keyframe (GeoSLAM §4.2, algorithm 2).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/model/ekf_output.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/odometry.hpp"
#include "services/keyframer/parameters.hpp"

namespace understory::keyframer {

/// Why a scan or a keyframe was not used; counted for HEALTH.
struct KeyframerCounters {
  std::uint64_t scans = 0;
  std::uint64_t scans_unmatched = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t keyframes_withheld = 0;
  std::string last_reason;
};

/// A method of making keyframes. Two exist: `source` as the thesis describes it, `joint` (ours).
class KeyframerMethod {
 public:
  virtual ~KeyframerMethod() = default;
  /// Takes one scan; gives the keyframe that it completes, if any.
  virtual std::optional<model::Keyframe> add(const model::LandmarkScan& scan) = 0;
  /// Motion without landmarks, where there is any; used as a prediction and to bridge scans that
  /// see nothing.
  virtual void add(const model::Odometry& odometry) = 0;
  /// The inertial bias and the velocity as the filter knows them: odometry that comes later starts
  /// from there.
  virtual void add(const model::EkfPose& /*pose*/) {}
  /// The error of the level as the filter knows it: scans that come later are levelled by it.
  virtual void add(const model::EkfLevel& /*level*/) {}
  virtual const KeyframerCounters& counters() const = 0;
  /// The whole state, for a restart; load() takes what save() of the same method gave.
  virtual std::string save() const = 0;
  virtual void load(const std::string& state) = 0;
};

/// The method that `parameters.method` names.
std::unique_ptr<KeyframerMethod> make_keyframer(const KeyframerParameters& parameters);

}  // namespace understory::keyframer
