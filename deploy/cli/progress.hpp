// A line on the terminal that says how far a long call is and how long it will take.
#pragma once

#include <chrono>
#include <string>

namespace understory {

/// Writes to stderr; where that is a terminal, one line that is rewritten after the first half
/// second.
class Progress {
 public:
  /// What to do where stderr is no terminal.
  enum class Without { kSilence, kLines /* one for every tenth of the way */ };

  Progress(std::string what, double total, Without without = Without::kSilence);
  ~Progress();  ///< Clears the line.
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(double done);

 private:
  using Clock = std::chrono::steady_clock;
  void draw(double part, Clock::time_point now);

  std::string what_;
  double total_;
  Without without_;
  bool terminal_;
  bool shown_ = false;
  int tenths_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_;
};

}  // namespace understory
