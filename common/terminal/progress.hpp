// Progress and expected end of a long call, on stderr.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace understory::terminal {

/// A progress bar, redrawn in place if stderr is a terminal; it disappears at the end.
class Progress {
 public:
  /// Output if stderr is no terminal: nothing, one line for every tenth of the work, or one line
  /// every five seconds.
  enum class Without { kSilence, kTenths, kSeconds };
  using Clock = std::chrono::steady_clock;
  /// Output of the bar; the caller owns the file.
  struct Output {
    std::FILE* file = stderr;
    bool is_terminal = false;
  };
  /// stderr, which may be a terminal.
  static Output standard_error();

  /// `total`: the amount of work in any unit; 0 or less draws nothing.
  Progress(std::string what, double total, Without without = Without::kSilence,
           const Output& output = standard_error(), Clock::time_point start = Clock::now());
  ~Progress();  ///< Clears the line.
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Sets the amount done; draws ten times a second at most.
  void update(double done, Clock::time_point now = Clock::now());
  /// Adds to the amount done.
  void advance(double steps = 1.0) { update(done_ + steps); }

 private:
  void draw(Clock::time_point now);
  std::string time_left(Clock::time_point now) const;

  std::string what_;
  double total_;
  double done_ = 0.0;
  Without without_;
  Output output_;
  bool is_shown_ = false;
  int tenths_ = 0;
  Clock::time_point start_;
  Clock::time_point next_;
};

}  // namespace understory::terminal
