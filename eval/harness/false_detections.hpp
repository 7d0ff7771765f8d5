// Detections of what is no landmark, put among those of the extractor.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "common/bus/service.hpp"
#include "common/geometry/se2.hpp"

namespace understory::eval::harness {

/// How much is false.
struct FalseDetectionOptions {
  double share = 0.0;  ///< Of all detections, in [0, 1).
  /// Of the false ones: of things that stand somewhere for some seconds and are seen in every scan
  /// (people, cars). The others are somewhere else in each scan.
  double lasting = 0.5;
  double least_s = 1.0;  ///< That such a thing stands.
  double most_s = 5.0;   ///< Likewise.
  double within_m = 20.0;
  std::uint64_t seed = 1;
};

/// What was put in.
struct FalseDetectionCounts {
  std::uint64_t detections = 0;  ///< With the false ones.
  std::uint64_t clutter = 0;
  std::uint64_t of_things = 0;
  std::uint64_t things = 0;
};

/// A process between the extractor and the rest: `found` -> `landmarks`. `world_T_vehicle`: the
/// truth at a stamp; `counts` may be null.
bus::Service false_detection_service(const FalseDetectionOptions& options,
                                     std::function<geometry::SE2(model::Utime)> world_T_vehicle,
                                     std::shared_ptr<FalseDetectionCounts> counts,
                                     const std::string& found, const std::string& landmarks);

}  // namespace understory::eval::harness
