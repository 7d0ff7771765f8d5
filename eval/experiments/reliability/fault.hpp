// What is done to a system while it drives.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace understory::eval::experiments::reliability {

/// One delay: messages of sensors that are held back, or processes that are stopped; nothing is
/// lost by it. Seconds of the drive.
struct Fault {
  std::string what = {};
  std::vector<std::string> held_channels = {};  ///< Come in one burst at the end, in their order.
  std::vector<std::string> stopped_processes = {};  ///< SIGSTOP, and SIGCONT at the end.
  double from_s = 0.0;
  double to_s = 0.0;
};

/// From the end of one delay to the beginning of the next [s].
inline constexpr double kApart_s = 12.0;

/// When delays come, and of what.
struct DelayPlan {
  double from_s = 30.0;                ///< The first one.
  double longest_s = 10.0;             ///< From 0 on, uniformly.
  std::string only;                    ///< Those with this in their name; empty = all.
  std::vector<std::string> processes;  ///< That may be stopped.
};

/// Delays of channels and processes drawn at random, one alone or all. Throws std::invalid_argument
/// where none has `only` in its name.
std::vector<Fault> draw_delays(const DelayPlan& plan, std::size_t count, std::mt19937_64& random);

}  // namespace understory::eval::experiments::reliability
