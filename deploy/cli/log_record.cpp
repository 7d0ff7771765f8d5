// `understory log record`: records the bus into a log, through the checked receiver.
#include <fmt/format.h>
#include <poll.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <regex>

#include "common/bus/live_bus.hpp"
#include "common/io/lcm_log.hpp"
#include "common/terminal/interrupt.hpp"
#include "deploy/cli/failure.hpp"
#include "deploy/cli/log_commands.hpp"

namespace understory::cli {
namespace {

using RecordClock = std::chrono::steady_clock;

/// Messages that may wait for a slow disk, in at most 256 MiB; then the oldest are dropped and
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

/// The recorded groups and their log.
class Recorder {
 public:
  Recorder(const std::string& file, const RecordOptions& options)
      : filter_(channel_filter(options.channels)),
        bus_(options.lcm_url, options.sweeps ? bus::Groups::kWithBulk : bus::Groups::kOne) {
    bus_.subscribe_all(kMostWaitingMessages,
                       [this](const bus::BusMessage& message) { write(message); });
    // Created after the bus, so that without a bus no empty file is left.
    writer_.emplace(file,
                    options.force ? io::LogCreation::kGrowingReplace : io::LogCreation::kGrowing);
  }

  /// Writes the waiting messages; false = none.
  bool write_waiting() {
    // A bounded number, so that messages cannot delay the end.
    int written = 0;
    while (written < 1000 && bus_.handle_one(0)) ++written;
    return written > 0;
  }

  void wait(std::chrono::milliseconds timeout) {
    pollfd file{bus_.file_descriptor(), POLLIN, 0};
    ::poll(&file, 1, static_cast<int>(timeout.count()));
  }

  void flush() { writer_->flush(); }
  void commit() { writer_->commit(); }
  std::uint64_t events() const { return writer_->events(); }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t lost() const { return bus_.dropped_of_all(); }
  std::uint64_t refused() const { return bus_.refused_datagrams().total(); }

 private:
  void write(const bus::BusMessage& message) {
    const auto& channel = message.channel;
    if (filter_ && !std::regex_match(channel.begin(), channel.end(), *filter_)) return;
    writer_->write(message.received_us, channel, message.bytes);
    bytes_ += message.bytes.size();
  }

  std::optional<std::regex> filter_;
  std::optional<io::LcmLogWriter> writer_;
  std::uint64_t bytes_ = 0;
  bus::LiveBus bus_;
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

  // Write the messages received before the signal, for a limited time in a flood.
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
