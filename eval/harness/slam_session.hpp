// Keyframer and mapper in one process, scan by scan, with the time that each takes.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/model/keyframe.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/map.hpp"
#include "eval/harness/submap_shelf.hpp"

namespace understory::eval::harness {

/// What an experiment asks of a keyframer: the services' or a baseline's. None of them is empty.
struct Keyframing {
  /// Takes one scan; gives the keyframe that it completed, if any.
  std::function<std::optional<model::Keyframe>(const model::LandmarkScan&)> add;
  /// Keyframes that come before the one that `add` gave.
  std::function<std::vector<model::Keyframe>()> take_waited;
  /// Keyframes that were gathered, but not good enough to give out.
  std::function<std::uint64_t()> withheld;
};

/// What an experiment asks of a mapper: the services' or a baseline's. None of them is empty.
struct Mapping {
  /// Localises the keyframe and fuses it.
  std::function<model::MapUpdate(const model::Keyframe&)> add;
  /// The pose of every keyframe's base, in order of time.
  std::function<std::vector<model::KeyframePose>()> trajectory;
  /// Every landmark of the map, in order of id.
  std::function<std::vector<model::MapLandmark>()> landmarks;
  /// Puts away what the mapper gave away, and gives back what it wants: after each keyframe.
  std::function<void(SubmapShelf&)> exchange_submaps;
};

/// The two stages of one method.
struct Stages {
  Keyframing keyframer;
  Mapping mapper;
};

/// New stages of a method ("baseline", "smoothing") with its parameters as published. What is
/// farther than `hand_over_m` from the vehicle leaves the mapper of "smoothing"; 0: nothing. Throws
/// std::invalid_argument for an unknown name.
Stages make_stages(std::string_view method, double hand_over_m = 0.0);

/// What became of a scan that completed a keyframe.
struct KeyframeOutcome {
  model::Keyframe keyframe;
  model::MapUpdate update;
  double keyframer_s = 0.0;  ///< Of all scans since the last keyframe.
  double mapper_s = 0.0;
};

/// Keyframer and mapper of one method, fed with scans in order of time.
class SlamSession {
 public:
  /// Takes the stages over, as they are.
  explicit SlamSession(Stages stages);

  /// Takes one scan; gives what became of the keyframe that it completed, if any.
  std::optional<KeyframeOutcome> feed(const model::LandmarkScan& scan);
  /// True if the last scan completed a keyframe that the keyframer withheld.
  bool withheld_one() const { return withheld_one_; }

  /// The mapper, to ask for its map.
  const Mapping& mapper() const { return stages_.mapper; }

 private:
  Stages stages_;
  double keyframer_s_ = 0.0;
  bool withheld_one_ = false;
};

}  // namespace understory::eval::harness
