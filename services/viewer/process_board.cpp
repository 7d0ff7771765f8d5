#include "services/viewer/process_board.hpp"

namespace understory::viewer {

void ProcessBoard::take(const health_t& health, std::int64_t wall_us) {
  if (entries_.size() >= kMostProcesses && !entries_.contains(health.process)) return;
  Entry& entry = entries_[health.process];
  if (entry.health.pid != health.pid) {
    entry.cpu_s.reset();
    entry.cpu_share.reset();
  }
  entry.health = health;
  entry.heard_us = wall_us;
  entry.has_ended = false;
  entry.is_silent = false;
  change_ = ++*changes_;
}

void ProcessBoard::take(const std::string& process, const ProcessSample& sample,
                        std::int64_t wall_us) {
  const auto found = entries_.find(process);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  if (entry.has_ended == sample.is_running) {
    entry.has_ended = !sample.is_running;
    change_ = ++*changes_;
  }
  if (!sample.is_running) return;
  if (entry.cpu_s && wall_us - entry.cpu_us < 1'000'000) return;
  if (entry.cpu_s)
    entry.cpu_share =
        (sample.cpu_s - *entry.cpu_s) / (1e-6 * static_cast<double>(wall_us - entry.cpu_us));
  entry.cpu_s = sample.cpu_s;
  entry.cpu_us = wall_us;
}

void ProcessBoard::look(std::int64_t wall_us) {
  looked_us_ = wall_us;
  for (auto& [name, entry] : entries_) {
    const bool is_silent = entry.has_ended || wall_us - entry.heard_us > kSilent_us;
    if (is_silent == entry.is_silent) continue;
    entry.is_silent = is_silent;
    change_ = ++*changes_;
  }
}

void ProcessBoard::clear() {
  entries_.clear();
  change_ = ++*changes_;
}

}  // namespace understory::viewer
