// The share of passes that cannot see a point, in 16 bits.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/existence/odds.hpp"

namespace understory::existence {

/// 1 - v with a resolution of 0.01 %, at least 1.5e-5.
class MissedShare {
 public:
  static constexpr int kCodesPerOctave = 4096;

  MissedShare() = default;
  explicit MissedShare(double share) {
    const double code = std::round(-kCodesPerOctave * std::log2(std::max(1e-9, share)));
    code_ = static_cast<std::uint16_t>(std::clamp(code, 1.0, 65535.0));
  }

  double value() const { return std::exp2(-static_cast<double>(code_) / kCodesPerOctave); }
  /// (1 - v) / v.
  double odds() const { return odds_of(value()); }
  /// 1 - v for P of later passes, in steps of 2 %: a missed pass has at most a likelihood ratio of
  /// 200, and v from a few looks does not change the whole map.
  double stepped() const {
    return std::exp2(std::round(32.0 * std::log2(std::max(0.005, value()))) / 32.0);
  }

  /// For save and load.
  std::uint16_t code() const { return code_; }
  static MissedShare of(std::uint32_t code) {
    MissedShare result;
    result.code_ = static_cast<std::uint16_t>(std::clamp(code, 1U, 65535U));
    return result;
  }

 private:
  std::uint16_t code_ = 1;
};

}  // namespace understory::existence
