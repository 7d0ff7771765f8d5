// A line on the terminal that says how far a long call is and how long it will take.
#pragma once

#include <chrono>
#include <string>

namespace understory {

/// Writes to stderr, and only where that is a terminal; says nothing in the first half second.
class Progress {
 public:
  Progress(std::string what, double total);
  ~Progress();  ///< Clears the line.
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void update(double done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  double total_;
  bool terminal_;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_;
};

}  // namespace understory
