#include "common/terminal/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace understory::terminal {
namespace {

constexpr int kWidth = 30;
/// Shorter calls show nothing.
constexpr std::chrono::milliseconds kQuiet{500};
constexpr std::chrono::milliseconds kRedraw{100};
constexpr std::chrono::seconds kLine{5};

std::string duration(double seconds) {
  const auto whole = std::lround(seconds);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

}  // namespace

Progress::Output Progress::standard_error() { return {stderr, ::isatty(STDERR_FILENO) == 1}; }

Progress::Progress(std::string what, double total, Without without, const Output& output,
                   Clock::time_point start)
    : what_(std::move(what)),
      total_(total),
      without_(without),
      output_(output),
      start_(start),
      next_(start_ + (output_.is_terminal ? std::chrono::milliseconds(kQuiet) : kLine)) {}

Progress::~Progress() {
  if (is_shown_) fmt::print(output_.file, "\r\033[K");
}

void Progress::update(double done, Clock::time_point now) {
  if (total_ <= 0.0) return;
  done_ = std::clamp(done, 0.0, total_);
  if (output_.is_terminal || without_ == Without::kSeconds) {
    if (now >= next_) draw(now);
  } else if (without_ == Without::kTenths) {
    const int tenths = static_cast<int>(10.0 * done_ / total_);
    if (tenths > tenths_) fmt::print(output_.file, "{}: {} %\n", what_, 10 * tenths);
    tenths_ = tenths;
  }
}

std::string Progress::time_left(Clock::time_point now) const {
  const double share = done_ / total_;
  if (share < 0.01) return {};
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  return fmt::format(", {} left", duration(elapsed_s * (1.0 - share) / share));
}

void Progress::draw(Clock::time_point now) {
  const double share = done_ / total_;
  const int filled = static_cast<int>(share * kWidth);
  const std::string line = fmt::format("{} [{:#<{}}{:.<{}}] {:3.0f} %{}", what_, "", filled, "",
                                       kWidth - filled, 100.0 * share, time_left(now));

  if (output_.is_terminal) {
    fmt::print(output_.file, "\r\033[K{}", line);
    std::fflush(output_.file);
    is_shown_ = true;
    next_ = now + kRedraw;
  } else {
    fmt::print(output_.file, "{}\n", line);
    next_ = now + kLine;
  }
}

}  // namespace understory::terminal
