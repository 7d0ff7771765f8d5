// The plain counter: log-odds up with a hit, down with a miss (Moravec and Elfes 1985, per point).
#pragma once

#include <algorithm>
#include <cmath>

namespace understory::eval::experiments::existence::peers {

/// Log-odds between two bounds.
class LogOddsCounter {
 public:
  LogOddsCounter(double recall, double false_rate, double most)
      : hit_(std::log(recall / false_rate)),
        miss_(std::log((1.0 - recall) / (1.0 - false_rate))),
        most_(most),
        log_odds_(most) {}
  void update(bool is_seen) {
    log_odds_ = std::clamp(log_odds_ + (is_seen ? hit_ : miss_), -most_, most_);
  }
  double probability() const { return 1.0 / (1.0 + std::exp(-log_odds_)); }

 private:
  double hit_;
  double miss_;
  double most_;
  double log_odds_;
};

}  // namespace understory::eval::experiments::existence::peers
