// How far a long call is and when it will end.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>

namespace understory::eval {

/// A bar on stderr that is redrawn in place; without a terminal, a line every few
/// seconds.
class Progress {
 public:
  Progress(std::string_view what, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::size_t steps = 1);

 private:
  void draw();

  std::string what_;
  std::size_t total_;
  std::size_t done_ = 0;
  bool terminal_;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point drawn_;
};

}  // namespace understory::eval
