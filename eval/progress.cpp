#include "eval/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace understory::eval {
namespace {

constexpr std::size_t kWidth = 30;
constexpr std::chrono::milliseconds kRedraw{200};
constexpr std::chrono::seconds kLine{5};  // without a terminal

std::string duration(double seconds) {
  const auto whole = std::lround(seconds);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

}  // namespace

Progress::Progress(std::string_view what, std::size_t total)
    : what_(what),
      total_(std::max<std::size_t>(1, total)),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()),
      drawn_(start_) {}

Progress::~Progress() {
  if (terminal_) fmt::print(stderr, "\r\033[K");
}

void Progress::advance(std::size_t steps) {
  done_ = std::min(total_, done_ + steps);
  const auto now = std::chrono::steady_clock::now();
  if (now - drawn_ < (terminal_ ? std::chrono::milliseconds(kRedraw) : kLine)) return;
  drawn_ = now;
  draw();
}

void Progress::draw() {
  const double elapsed = std::chrono::duration<double>(drawn_ - start_).count();
  const double left = elapsed * static_cast<double>(total_ - done_) / static_cast<double>(done_);
  const std::size_t filled = kWidth * done_ / total_;
  fmt::print(stderr, "{}[{}{}] {}/{} {}, {} left{}", terminal_ ? "\r\033[K" : "",
             std::string(filled, '#'), std::string(kWidth - filled, '.'), done_, total_, what_,
             duration(left), terminal_ ? "" : "\n");
  std::fflush(stderr);
}

}  // namespace understory::eval
