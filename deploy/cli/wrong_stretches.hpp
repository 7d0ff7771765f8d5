// Stretches of a drive on which the published pose was wrong, and whether a process said so.
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

/// When processes said that they are not well: by HEALTH with the state DEGRADED or ERROR. A
/// process without HEALTH in the log (`replay` writes none) is judged by its LOG: a warning counts
/// for 3 s, as in HEALTH, and until LOG says that it is over; a condition of a stage (lost,
/// diverged, ...) that is never over lasts to the end.
class AlarmCollector {
 public:
  void take(const health_t& health, std::int64_t log_utime);  ///< In the order of the log.
  void take(const log_t& message, std::int64_t log_utime);    ///< In the order of the log.
  /// In no order; spans may overlap.
  std::vector<ReceiveSpan> alarms() const;
  /// Whether any process stated how it is, by HEALTH or by LOG.
  bool has_any() const { return !health_.empty() || !logged_.empty(); }

 private:
  /// Process, channel, reason, text.
  using Warning = std::tuple<std::string, std::string, std::string, std::string>;
  std::map<std::string, std::vector<ReceiveSpan>> health_;  ///< By process; empty: always OK.
  std::map<std::string, std::vector<ReceiveSpan>> logged_;  ///< By process.
  std::map<Warning, std::int64_t> open_;                    ///< Since when.
};

/// A stretch of wrong poses.
struct WrongStretch {
  ReceiveSpan span;
  std::size_t poses = 0;
  double largest_error_m = 0.0;
  bool was_told = false;  ///< Some process was not well within kTellWithin_us of its start.
};
/// A pose is wrong where it is more than this off [m] ...
inline constexpr double kWrong_m = 1.0;
/// ... and its squared Mahalanobis distance in x and y is above this: a right covariance is
/// exceeded by chance in 0.27 % of all poses (three sigma), two degrees of freedom.
inline constexpr double kWrongSquaredSigmas = 11.829;
/// Wrong poses no further apart belong to one stretch [us]; HEALTH has as long to tell of it.
inline constexpr std::int64_t kTellWithin_us = 10'000'000;

/// Whether a pose is wrong. One whose covariance in x and y is not positive definite states that it
/// is exact.
bool is_wrong(const ComparedPose& pose);
/// The stretches of `poses`, which are in the order of the log.
std::vector<WrongStretch> wrong_stretches(std::span<const ComparedPose> poses,
                                          std::span<const ReceiveSpan> alarms);

}  // namespace understory::cli
