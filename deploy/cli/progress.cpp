#include "deploy/cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace understory {

Progress::Progress(std::string what, double total, Without without)
    : what_(std::move(what)),
      total_(total),
      without_(without),
      terminal_(::isatty(STDERR_FILENO) == 1),
      next_(start_ + std::chrono::milliseconds(500)) {}

Progress::~Progress() {
  if (shown_) fmt::print(stderr, "\r\033[K");
}

void Progress::update(double done) {
  if (total_ <= 0.0) return;
  const double part = std::clamp(done / total_, 0.0, 1.0);
  if (terminal_) {
    const auto now = Clock::now();
    if (now >= next_) draw(part, now);
  } else if (without_ == Without::kLines && static_cast<int>(part * 10.0) > tenths_) {
    tenths_ = static_cast<int>(part * 10.0);
    fmt::print(stderr, "{}: {} %\n", what_, 10 * tenths_);
  }
}

void Progress::draw(double part, Clock::time_point now) {
  next_ = now + std::chrono::milliseconds(100);
  shown_ = true;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const int filled = static_cast<int>(part * 30.0);
  fmt::print(stderr, "\r\033[K{} [{:#<{}}{:.<{}}] {:3.0f} %", what_, "", filled, "", 30 - filled,
             100.0 * part);
  if (part > 0.01) fmt::print(stderr, ", {:.0f} s left", elapsed_s * (1.0 - part) / part);
  std::fflush(stderr);
}

}  // namespace understory
