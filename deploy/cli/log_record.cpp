// `understory log record`: the bus into a log, through the checked receiver.
#include <fmt/format.h>
#include <poll.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <regex>
#include <vector>

#include "common/bus/live_bus.hpp"
#include "common/bus/split_bus.hpp"
#include "common/io/lcm_log.hpp"
#include "common/terminal/interrupt.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/log_commands.hpp"

namespace understory::cli {
namespace {

using RecordClock = std::chrono::steady_clock;

/// While the disk is slow so many messages wait, in at most 256 MiB; then the oldest are lost, and
/// counted.
constexpr std::size_t kMostWaitingMessages = 100000;

std::optional<std::regex> channel_filter(const std::string& channels) {
  if (channels.empty()) return std::nullopt;
  try {
    return std::regex(channels);
  } catch (const std::regex_error&) {
    wrong_usage(fmt::format("--channels {}: not a regular expression", channels));
  }
}

/// The groups that are recorded, and the log that they go into.
class Recorder {
 public:
  Recorder(const std::string& file, const RecordOptions& options)
      : filter_(channel_filter(options.channels)) {
    const std::string url = bus::complete_lcm_url(options.lcm_url);
    listen(url);
    if (options.sweeps) listen(bus::bulk_lcm_url(url));
    // Behind the bus: where there is none, no empty file is left.
    writer_.emplace(file,
                    options.force ? io::LogCreation::kGrowingReplace : io::LogCreation::kGrowing);
  }

  /// Writes what waits; false = nothing did.
  bool write_waiting() {
    bool wrote = false;
    for (const auto& one : buses_) {
      // A bounded number: neither group may keep the other one, or the end, waiting.
      for (int i = 0; i < 1000 && one->handle_one(0); ++i) wrote = true;
    }
    return wrote;
  }

  void wait(std::chrono::milliseconds timeout) {
    std::vector<pollfd> files;
    for (const auto& one : buses_) files.push_back({one->file_descriptor(), POLLIN, 0});
    ::poll(files.data(), files.size(), static_cast<int>(timeout.count()));
  }

  void flush() { writer_->flush(); }
  void commit() { writer_->commit(); }
  std::uint64_t events() const { return writer_->events(); }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t lost() const {
    std::uint64_t sum = 0;
    for (const auto& one : buses_) sum += one->dropped_of_all();
    return sum;
  }
  std::uint64_t refused() const {
    std::uint64_t sum = 0;
    for (const auto& one : buses_) sum += one->refused_datagrams().total();
    return sum;
  }

 private:
  void listen(const std::string& url) {
    buses_.push_back(std::make_unique<bus::LiveBus>(url));
    buses_.back()->subscribe_all(kMostWaitingMessages, [this](const bus::BusMessage& message) {
      const auto& channel = message.channel;
      if (filter_ && !std::regex_match(channel.begin(), channel.end(), *filter_)) return;
      writer_->write(message.received_us, channel, message.bytes);
      bytes_ += message.bytes.size();
    });
  }

  std::optional<std::regex> filter_;
  std::optional<io::LcmLogWriter> writer_;
  std::uint64_t bytes_ = 0;
  std::vector<std::unique_ptr<bus::LiveBus>> buses_;
};

void record_until(Recorder& recorder, const std::atomic<bool>& is_interrupted) {
  constexpr auto kFlushPeriod = std::chrono::seconds(1);
  auto flush_due = RecordClock::now() + kFlushPeriod;
  while (!is_interrupted) {
    if (!recorder.write_waiting()) recorder.wait(std::chrono::milliseconds(100));
    if (RecordClock::now() < flush_due) continue;
    recorder.flush();
    flush_due = RecordClock::now() + kFlushPeriod;
  }

  // What had come before the signal, but a flood is not waited for.
  const auto end = RecordClock::now() + std::chrono::seconds(1);
  while (RecordClock::now() < end && recorder.write_waiting()) {
  }
  recorder.commit();
}

}  // namespace

void log_record(const std::string& file, const RecordOptions& options) {
  const std::atomic<bool>& is_interrupted = terminal::catch_interrupts();
  if (!options.force && std::filesystem::is_regular_file(file)) {
    fail(fmt::format("{}: exists; --force overwrites it", file));
  }

  Recorder recorder(file, options);
  try {
    record_until(recorder, is_interrupted);
  } catch (const io::LogError& error) {
    fail(fmt::format("{}; recording ends after {} messages", error.what(), recorder.events()));
  }

  fmt::print("{}: {} messages, {} bytes\n", file, recorder.events(), recorder.bytes());
  if (recorder.lost() > 0) fmt::print("{} more were lost: the disk is too slow\n", recorder.lost());
  if (recorder.refused() > 0) {
    fmt::print("{} datagrams were refused: they are no messages of LCM\n", recorder.refused());
  }
}

}  // namespace understory::cli
