// Converts a recording to a log: small messages are stored and written in order of time between the
// sweeps, which are too large to store.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "common/io/data_error.hpp"
#include "common/model/point_sweep.hpp"
#include "common/wire/convert.hpp"
#include "deploy/cli/original_log.hpp"

namespace understory::cli {

/// Writes a log completely or not at all; without commit() no file is left.
class RecordingLog {
 public:
  /// Throws LogError where the file cannot be created.
  explicit RecordingLog(const std::string& file) : writer_(file, "understory import") {}

  /// Stores a message until the log reaches its stamp; messages of one stamp stay in the order of
  /// adding.
  template <class Message>
  void add(const std::string& channel, Message message) {
    set_sequence(message, counts_[channel]++);
    small_span_.add(message.utime);
    small_.emplace(message.utime, Event{channel, wire::encode_message(message)});
  }
  /// Writes the messages due before the end of the revolution, then the sweep's parts.
  void add_sweep(const std::string& channel, const model::PointSweep& sweep) {
    float last = 0.0F;
    for (const model::SweepPoint& point : sweep.points) last = std::max(last, point.time_s);
    const model::Utime end = sweep.utime + static_cast<model::Utime>(1e6F * last);
    write_until(end);
    sweep_span_.add(sweep.utime);
    for (model::PointSweep& part : split_sweep(sweep, kPointsPerPart)) {
      part.sequence = counts_[channel]++;
      writer_.write(std::max(end, latest_), channel, wire::encode_message(part));
    }
    latest_ = std::max(end, latest_);
  }
  /// Writes the rest and gives the log its name.
  void commit() {
    while (!small_.empty()) write_first();
    writer_.commit();
  }
  /// Throws io::DataError where the times of sweeps and other messages do not overlap: they have
  /// different clocks.
  void require_common_time() const {
    if (!sweep_span_.overlaps(small_span_))
      throw io::DataError(
          fmt::format("sweeps from {:.3f} to {:.3f} s, other messages from {:.3f} to {:.3f} s: "
                      "their clocks have "
                      "no time in common",
                      1e-6 * static_cast<double>(sweep_span_.first),
                      1e-6 * static_cast<double>(sweep_span_.last),
                      1e-6 * static_cast<double>(small_span_.first),
                      1e-6 * static_cast<double>(small_span_.last)));
  }
  /// Messages added on this channel, parts of sweeps counted singly.
  std::uint64_t count(const std::string& channel) const {
    const auto found = counts_.find(channel);
    return found == counts_.end() ? 0 : found->second;
  }

 private:
  static constexpr std::size_t kPointsPerPart = 4000;
  struct Event {
    std::string channel;
    wire::Bytes bytes;
  };

  template <class Message>
  static void set_sequence(Message& message, std::uint64_t sequence) {
    if constexpr (requires { message.seq; }) {
      message.seq = static_cast<std::int64_t>(sequence);
    } else {
      message.sequence = sequence;
    }
  }
  void write_until(model::Utime utime) {
    while (!small_.empty() && small_.begin()->first <= utime) write_first();
  }
  void write_first() {
    const auto first = small_.begin();
    latest_ = std::max(latest_, first->first);
    writer_.write(latest_, first->second.channel, first->second.bytes);
    small_.erase(first);
  }

  /// The stamps of some messages.
  struct Span {
    model::Utime first = std::numeric_limits<model::Utime>::max();
    model::Utime last = std::numeric_limits<model::Utime>::min();

    void add(model::Utime utime) {
      first = std::min(first, utime);
      last = std::max(last, utime);
    }
    /// True also where one of them is empty.
    bool overlaps(const Span& other) const {
      constexpr model::Utime kApart = 10'000'000;
      const bool is_one_empty = last < first || other.last < other.first;
      return is_one_empty || (first <= other.last + kApart && other.first <= last + kApart);
    }
  };

  OriginalLog writer_;
  Span sweep_span_, small_span_;
  std::multimap<model::Utime, Event> small_;
  std::map<std::string, std::uint64_t> counts_;
  model::Utime latest_ = 0;
};

}  // namespace understory::cli
