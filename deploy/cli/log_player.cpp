#include "deploy/cli/log_player.hpp"

#include <chrono>

namespace understory::cli {
namespace {

constexpr int kEventsPerLook = 64;

}  // namespace

LogSpan span_of_log(const std::filesystem::path& log, const std::function<void(double)>& progress) {
  io::LcmLogReader reader(log);
  std::optional<LogSpan> span;
  std::uint64_t events = 0;
  while (const auto event = reader.next()) {
    if (!span) span = {event->utime, event->utime};
    span->from_us = std::min(span->from_us, event->utime);
    span->to_us = std::max(span->to_us, event->utime);
    if (++events % 1024 == 0 && progress)
      progress(static_cast<double>(reader.position_bytes()) /
               static_cast<double>(reader.size_bytes()));
  }
  reader.refuse_other_files();
  if (!span) throw io::LogError(log.string() + ": no events");
  return *span;
}

LogPlayer::LogPlayer(std::filesystem::path log, viewer::Run& run)
    : path_(std::move(log)), run_(run) {
  viewer::for_each_channel(
      [this]<class T>(const char* channel, const viewer::ChannelTraits& /*traits*/, auto take) {
        takes_[channel] = [this, take](std::span<const std::uint8_t> bytes, std::int64_t wall_us) {
          const auto value = wire::decode_message<T>(bytes);
          if (!value) return false;
          run_.take(*value, take, wall_us);
          return true;
        };
      });
  restart();
}

void LogPlayer::restart() {
  run_.reset();
  reader_.emplace(path_);
  next_ = reader_->next();
  refused_ = 0;
}

bool LogPlayer::go_to(std::int64_t utime_us, std::int64_t most_us) {
  if (utime_us < at_us_) restart();
  at_us_ = utime_us;
  const auto end = std::chrono::steady_clock::now() + std::chrono::microseconds(most_us);
  for (int events = 1; next_ && next_->utime <= utime_us; ++events) {
    const auto take = takes_.find(next_->channel);
    if (take != takes_.end() && !take->second(next_->data, next_->utime)) ++refused_;
    next_ = reader_->next();
    if (events % kEventsPerLook == 0 && std::chrono::steady_clock::now() > end) return false;
  }
  // The end of a log makes no process silent: time is the position of the scrubber.
  run_.scene().look(utime_us);
  return true;
}

}  // namespace understory::cli
