// Contents and faults of a recorded log.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "common/io/lcm_log.hpp"

namespace understory::cli {

/// Counts of one channel.
struct ChannelStatistics {
  std::string type;  ///< Wire type; "?" = none of lcmtypes/, "mixed" = several.
  std::uint64_t events = 0;
  std::uint64_t bytes = 0;  ///< Bytes of the payloads.
  std::int64_t first_utime = 0;
  std::int64_t last_utime = 0;
  std::uint64_t malformed = 0;  ///< For our types: number of malformed messages.
  std::string last_malformed;   ///< Reason of the last of them.
  std::uint64_t lost = 0;       ///< Missing sequence numbers, between the first and the last.
  std::uint64_t restarts = 0;   ///< Number of times the sequence went back.
  /// Number of times the message's own stamp went back without a restart.
  std::uint64_t stamps_back = 0;

  /// Mean rate between the first and the last event; 0 for one event.
  double rate_hz() const;
};

/// Collects a log's events.
class LogStatistics {
 public:
  /// Takes one event, in the order of the log.
  void add(const io::LogEvent& event);

  /// Statistics by channel name.
  const std::map<std::string, ChannelStatistics>& channels() const { return channels_; }
  /// The programs in CONFIG and HEALTH with their versions; at most 1000.
  const std::set<std::pair<std::string, std::string>>& programs() const { return programs_; }
  /// Number of events.
  std::uint64_t events() const { return events_; }
  std::int64_t first_utime() const { return first_utime_; }  ///< First receive time [us].
  std::int64_t last_utime() const { return last_utime_; }    ///< Last receive time [us].
  /// Between the first and the last event.
  double duration_s() const { return 1e-6 * static_cast<double>(last_utime_ - first_utime_); }
  /// Event numbers missing in the log.
  std::uint64_t missing_numbers() const { return missing_numbers_; }
  std::uint64_t clock_back() const {
    return clock_back_;
  }  ///< Number of times the receive time went back.
  std::uint64_t clock_forward() const {
    return clock_forward_;
  }  ///< Number of steps forward by more than ten seconds.
  /// Longest time without any event.
  double longest_silence_s() const { return 1e-6 * static_cast<double>(longest_silence_us_); }

 private:
  struct LastHeader {
    std::int64_t utime = 0;
    std::int64_t sequence = 0;
  };
  void note_program(const io::LogEvent& event);
  void check_payload(const io::LogEvent& event, ChannelStatistics& channel);

  std::map<std::string, ChannelStatistics> channels_;
  std::map<std::string, LastHeader> last_headers_;
  std::set<std::pair<std::string, std::string>> programs_;
  std::uint64_t events_ = 0;
  std::int64_t first_utime_ = 0;
  std::int64_t last_utime_ = 0;
  std::int64_t last_number_ = -1;
  std::uint64_t missing_numbers_ = 0;
  std::uint64_t clock_back_ = 0;
  std::uint64_t clock_forward_ = 0;
  std::int64_t longest_silence_us_ = 0;
};

}  // namespace understory::cli
