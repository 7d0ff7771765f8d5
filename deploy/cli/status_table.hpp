// HEALTH of all processes as a table or as JSON.
#pragma once

#include <chrono>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "understory/health_t.hpp"

namespace understory::cli {

class StatusTable {
 public:
  using Clock = std::chrono::steady_clock;
  /// HEALTH comes once a second: three missed, and the process does not answer.
  static constexpr std::chrono::seconds kSilent{3};

  void add(const health_t& health, Clock::time_point now);
  bool empty() const { return latest_.empty(); }
  std::string text(Clock::time_point now) const;
  nlohmann::ordered_json json(Clock::time_point now) const;

 private:
  struct Entry {
    health_t health;
    Clock::time_point received;
    bool silent(Clock::time_point now) const { return now - received >= kSilent; }
  };
  std::map<std::string, Entry> latest_;  ///< By name of the process.
};

}  // namespace understory::cli
