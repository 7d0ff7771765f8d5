#include "deploy/cli/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace understory {

Progress::Progress(std::string what, double total)
    : what_(std::move(what)),
      total_(total),
      terminal_(::isatty(STDERR_FILENO) == 1),
      next_(start_ + std::chrono::milliseconds(500)) {}

Progress::~Progress() {
  if (shown_) fmt::print(stderr, "\r\033[K");
}

void Progress::update(double done) {
  if (!terminal_ || total_ <= 0.0) return;
  const auto now = Clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  shown_ = true;
  const double part = std::clamp(done / total_, 0.0, 1.0);
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const int filled = static_cast<int>(part * 30.0);
  fmt::print(stderr, "\r\033[K{} [{:#<{}}{:.<{}}] {:3.0f} %", what_, "", filled, "", 30 - filled,
             100.0 * part);
  if (part > 0.01) fmt::print(stderr, ", {:.0f} s left", elapsed_s * (1.0 - part) / part);
  std::fflush(stderr);
}

}  // namespace understory
