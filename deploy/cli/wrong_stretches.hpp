// Intervals of a drive with wrong published poses, and whether a process reported them.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "deploy/cli/compared_pose.hpp"
#include "understory/health_t.hpp"
#include "understory/log_t.hpp"

namespace understory::cli {

/// A span of the log's receive times [us], both ends included.
struct ReceiveSpan {
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
};

/// Collects the times at which processes reported faults: by HEALTH with the state DEGRADED or
/// ERROR. A process without HEALTH in the log (`replay` writes none) is judged by its LOG: a
/// warning lasts 3 s, as in HEALTH, and until LOG reports its end; a condition of a stage (lost,
/// diverged, ...) without an end lasts to the end of the log.
class AlarmCollector {
 public:
  /// Takes HEALTH, in the order of the log.
  void take(const health_t& health, std::int64_t log_utime);
  void take(const log_t& message, std::int64_t log_utime);  ///< Takes LOG, in the order of the log.
  /// The spans, in no order; they may overlap.
  std::vector<ReceiveSpan> alarms() const;
  /// Whether any process reported its state by HEALTH or by LOG.
  bool has_any() const { return !health_.empty() || !logged_.empty(); }

 private:
  /// Process, channel, reason, text.
  using Warning = std::tuple<std::string, std::string, std::string, std::string>;
  std::map<std::string, std::vector<ReceiveSpan>>
      health_;  ///< Spans by process; empty = always OK.
  std::map<std::string, std::vector<ReceiveSpan>> logged_;  ///< Spans by process.
  std::map<Warning, std::int64_t> open_;                    ///< Start of each open warning.
};

/// An interval of wrong poses.
struct WrongStretch {
  ReceiveSpan span;
  std::size_t poses = 0;
  double largest_error_m = 0.0;
  bool was_told = false;  ///< A process reported a fault within kTellWithin_us of its start.
};
/// A pose is wrong if its error is above this [m] ...
inline constexpr double kWrong_m = 1.0;
/// ... and its squared Mahalanobis distance in x and y is above this: with a right covariance,
/// chance exceeds it in 0.27 % of all poses (three sigma), two degrees of freedom.
inline constexpr double kWrongSquaredSigmas = 11.829;
/// Wrong poses no further apart than this belong to one interval [us]; HEALTH must report it within
/// the same time.
inline constexpr std::int64_t kTellWithin_us = 10'000'000;

/// Whether a pose is wrong. A covariance in x and y that is not positive definite counts as exact.
bool is_wrong(const ComparedPose& pose);
/// The wrong intervals of `poses`, which must be in the order of the log.
std::vector<WrongStretch> wrong_stretches(std::span<const ComparedPose> poses,
                                          std::span<const ReceiveSpan> alarms);

}  // namespace understory::cli
