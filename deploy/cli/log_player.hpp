// Shows a recorded run at any of its times.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "common/io/lcm_log.hpp"
#include "services/viewer/run.hpp"

namespace understory::cli {

/// Time span of a log's events.
struct LogSpan {
  std::int64_t from_us = 0;
  std::int64_t to_us = 0;
};

/// First and last time of a log's events; `progress` gets the fraction done, 0..1, repeatedly.
/// Throws io::LogError, also where the log has no events.
LogSpan span_of_log(const std::filesystem::path& log, const std::function<void(double)>& progress);

/// Feeds a run with a log's events up to a time. Forward it continues to read; backward it
/// restarts.
class LogPlayer {
 public:
  /// `run` must outlive it. Throws io::LogError.
  LogPlayer(std::filesystem::path log, viewer::Run& run);

  /// Feeds the events recorded up to `utime_us`, for at most `most_us` of work. True when this time
  /// is reached.
  bool go_to(std::int64_t utime_us, std::int64_t most_us);
  /// Number of malformed messages so far.
  std::uint64_t refused() const { return refused_; }

 private:
  using Take = std::function<bool(std::span<const std::uint8_t> bytes, std::int64_t wall_us)>;
  void restart();

  std::filesystem::path path_;
  viewer::Run& run_;
  std::map<std::string, Take, std::less<>> takes_;
  std::optional<io::LcmLogReader> reader_;
  std::optional<io::LogEvent> next_;
  std::int64_t at_us_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace understory::cli
