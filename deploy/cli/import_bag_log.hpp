// The log that a bag becomes: messages in order of their own stamps, within a window of time.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/model/point_sweep.hpp"
#include "common/wire/convert.hpp"
#include "deploy/cli/original_log.hpp"

namespace understory::cli {

/// Writes a log whole or not at all; without commit() nothing is left behind. A message waits until
/// another one is kWindow_us later: what a recorder got in another order is laid straight. Memory:
/// the messages of that window.
class BagLog {
 public:
  /// Throws LogError when the file cannot be created.
  explicit BagLog(const std::string& file) : writer_(file, "understory import") {}

  /// Adds a message that is complete at `due`.
  template <class Message>
  void add(const std::string& channel, Message message, model::Utime due) {
    set_number(message, counts_[channel]++);
    waiting_.emplace(Key{due, rank_of(channel)}, Event{channel, wire::encode_message(message)});
    write_until(waiting_.rbegin()->first.first - kWindow_us);
  }
  /// A sweep, in parts, complete with its last point.
  void add_sweep(const model::PointSweep& sweep) {
    float last = 0.0F;
    for (const model::SweepPoint& point : sweep.points) last = std::max(last, point.time_s);
    const model::Utime end = sweep.utime + static_cast<model::Utime>(1e6F * last);
    ++sweeps_;
    for (model::PointSweep& part : split_sweep(sweep, kPointsPerMessage))
      add("RAW_SWEEP", std::move(part), end);
  }
  /// Writes the rest; the log takes its name.
  void commit() {
    while (!waiting_.empty()) write_first();
    writer_.commit();
  }
  /// Messages added on this channel, parts of sweeps counted singly.
  std::uint64_t count(const std::string& channel) const {
    const auto found = counts_.find(channel);
    return found == counts_.end() ? 0 : found->second;
  }
  std::uint64_t sweeps() const { return sweeps_; }  ///< Added.
  std::uint64_t late() const { return late_; }      ///< Messages that came after the window.

 private:
  static constexpr model::Utime kWindow_us = 1'000'000;
  /// Of 10 bytes each: a message stays below the 64 KiB of one datagram.
  static constexpr std::size_t kPointsPerMessage = 5900;
  struct Event {
    std::string channel;
    wire::Bytes bytes;
  };
  using Key = std::pair<model::Utime, int>;  ///< When it is complete, rank_of().

  /// Of one stamp motion comes first, so that whoever takes a sweep has the motion up to it; and
  /// the log does not depend on the order in which a recorder got them.
  static int rank_of(const std::string& channel) {
    if (channel == "RAW_IMU") return 0;
    if (channel == "RAW_WHEELS") return 1;
    if (channel == "RAW_GNSS") return 2;
    return channel == "GROUND_TRUTH" ? 3 : 4;
  }

  template <class Message>
  static void set_number(Message& message, std::uint64_t number) {
    if constexpr (requires { message.seq; }) {
      message.seq = static_cast<std::int64_t>(number);
    } else {
      message.sequence = number;
    }
  }
  void write_until(model::Utime utime) {
    while (!waiting_.empty() && waiting_.begin()->first.first <= utime) write_first();
  }
  void write_first() {
    const auto first = waiting_.begin();
    if (first->first.first < latest_) ++late_;
    latest_ = std::max(latest_, first->first.first);
    writer_.write(latest_, first->second.channel, first->second.bytes);
    waiting_.erase(first);
  }

  OriginalLog writer_;
  std::multimap<Key, Event> waiting_;
  std::map<std::string, std::uint64_t> counts_;
  std::uint64_t sweeps_ = 0;
  std::uint64_t late_ = 0;
  model::Utime latest_ = 0;
};

}  // namespace understory::cli
