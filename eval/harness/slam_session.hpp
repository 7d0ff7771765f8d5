// Keyframer and mapper in one process, scan by scan, with the time that each takes.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/geoslam_mapper/geoslam_mapper.hpp"
#include "services/keyframer/keyframer.hpp"

namespace understory::eval::harness {

/// The two stages of one method.
struct Stages {
  std::unique_ptr<keyframer::KeyframerMethod> keyframer;
  std::unique_ptr<geoslam_mapper::MapperMethod> mapper;
};

/// Names of the methods that make_stages() takes: "baseline", "smoothing".
const std::vector<std::string>& method_names();
/// New stages of a method with its parameters as published. What is farther than `hand_over_m` from
/// the vehicle leaves the mapper of "smoothing"; 0: nothing. Throws std::invalid_argument for an
/// unknown name.
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
  /// Takes the stages over, as they are: new or loaded.
  explicit SlamSession(Stages stages);

  /// Takes one scan; gives what became of the keyframe that it completed, if any.
  std::optional<KeyframeOutcome> feed(const model::LandmarkScan& scan);
  /// True if the last scan completed a keyframe that the keyframer withheld.
  bool withheld_one() const { return withheld_one_; }

  /// The mapper, to take what it gives away.
  geoslam_mapper::MapperMethod& mapper() { return *stages_.mapper; }
  /// The mapper, to ask for its map.
  const geoslam_mapper::MapperMethod& mapper() const { return *stages_.mapper; }
  /// The keyframer, to ask for its counters.
  const keyframer::KeyframerMethod& keyframer() const { return *stages_.keyframer; }

 private:
  Stages stages_;
  double keyframer_s_ = 0.0;
  bool withheld_one_ = false;
};

}  // namespace understory::eval::harness
