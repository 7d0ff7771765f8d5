// Values for plots, as small flat messages of our own schemas (understory.NAME).
#pragma once

#include <limits>
#include <map>
#include <string>
#include <string_view>

#include "common/model/ekf_output.hpp"
#include "common/model/existence.hpp"
#include "common/model/imu.hpp"
#include "common/model/slam_output.hpp"
#include "common/model/submap.hpp"
#include "understory/health_t.hpp"

namespace understory::foxglove {

/// Values of a SLAM_POSE. NaN = unknown; the field is left out.
struct PoseNumbers {
  model::SlamPose pose;
  /// Time from the stamp of the observation to the reception of its pose [s]; valid only live.
  double latency_s = std::numeric_limits<double>::quiet_NaN();
  /// Error of the position against GROUND_TRUTH, whose frame is aligned with the map at the first
  /// common stamp.
  double error_m = std::numeric_limits<double>::quiet_NaN();
  double error_deg = std::numeric_limits<double>::quiet_NaN();  ///< The same for the heading.
};

/// Values of LOOP_CLOSURE (without a result) or LOOP_RESULT.
struct LoopNumbers {
  model::Utime utime = 0;
  std::uint64_t closure_id = 0;
  std::string source;  ///< Source of the closure; empty for a result.
  std::string status;  ///< sent, revoked, accepted, waiting or refused.
  std::string reason;
};

/// Name of a pose's status, as in `services/viewer/protocol.md`.
std::string_view status_text(const model::SlamPose& pose);

/// The messages as JSON; every one has a `timestamp`.
std::string to_json(const PoseNumbers& numbers);
/// NIS of the accepted pose with its degrees of freedom, and values of the search.
std::string to_json(const model::MapUpdate& update);
/// Sigmas, speed and biases of the filter.
std::string to_json(const model::EkfPose& pose);
/// Shares and counts of landmarks judged as removed.
std::string to_json(const model::Existence& existence);
/// Latencies, memory and losses of one process.
std::string to_json(const health_t& health);
/// A loop closure.
std::string to_json(const LoopNumbers& loop);
/// Rates and forces.
std::string to_json(const model::ImuSample& sample);

/// Their schemas, by name.
std::map<std::string_view, std::string> number_schemas();

}  // namespace understory::foxglove
