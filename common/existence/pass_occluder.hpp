// Probability that an obstacle hides a point during a whole pass, from ranges along the rays.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/existence/look.hpp"

namespace understory::existence {

/// Hidden variable H of a pass: an obstacle stands in front of the point from every viewpoint. It
/// is equally likely for an existing and a removed point. A look of a hidden pass measures a return
/// in front with probability kInFront, else no return, as at the edge of the obstacle; a look of
/// another pass with kBeside, from single objects. A pass with a free line of sight in one look is
/// not hidden; nor is a pass without a return in front: there only directions give evidence of
/// occlusion. Hits are not counted; they are direct evidence. 8 bits.
class PassOccluder {
 public:
  /// The state after a look that missed the point, from the range along its ray.
  PassOccluder after(Ray ray) const {
    if (ray == Ray::kPassed || code_ == kRefuted) return refuted();
    const unsigned one = ray == Ray::kBlocked ? kBlocked : kUnknown;
    const unsigned counted = ray == Ray::kBlocked ? code_ / kBlocked : code_ % kBlocked;
    if (code_ == kMostCounted * one) return *this;
    const unsigned code = counted == kMostCounted ? (code_ >> 1U) & 0x77U : code_;
    return of(static_cast<std::uint8_t>(code + one));
  }
  /// A return came from behind the point, or the pass found it: not hidden.
  static PassOccluder refuted() { return of(kRefuted); }

  /// p(H); 0 without a return in front.
  float chance() const { return chances()[code_]; }
  /// Likelihood ratio of the looks: an existing point without an occluder that the detector misses,
  /// against a removed point, hidden or not. An existing point stops the beams itself unless it is
  /// too thin; a removed point does not. 1 without a return in front.
  double stopped_itself() const {
    const double hidden = static_cast<double>(chance());
    const double by_itself = hidden * (1.0 - kPrior) / kPrior;
    return 1.0 - hidden + kStopsBeams * std::max(0.0, by_itself - (1.0 - hidden));
  }
  /// Whether a closed pass that did not see the point was probably hidden; missed_when_hidden()
  /// applies to such passes.
  bool is_hidden_pass() const { return static_cast<double>(chance()) >= kHiddenFrom; }
  /// chance() + stopped_itself() * missed_share for a typical hidden pass, independent of its
  /// returns. The ratio is nearly the same for all, and this form stays bounded when v approaches
  /// 1.
  static double missed_when_hidden(double missed_share) {
    return kHiddenPass * (1.0 + kItselfToHidden * missed_share);
  }
  /// The part of missed_when_hidden() missed by the detector.
  static double missed_itself(double missed_share) {
    return kItselfToHidden * missed_share / (1.0 + kItselfToHidden * missed_share);
  }
  /// Whether a return in front of the point or behind it was measured, or the point was found.
  bool has_told() const { return code_ >= kBlocked; }
  /// Whether there was no look yet.
  bool is_new() const { return code_ == 0; }

  /// For save and load: any byte is a state.
  std::uint8_t code() const { return code_; }
  static PassOccluder of(std::uint8_t code) {
    PassOccluder result;
    result.code_ = code;
    return result;
  }

 private:
  static constexpr double kPrior = 0.05;  ///< p(H).
  /// Share of looks with a return in front, in a hidden pass.
  static constexpr double kInFront = 0.7;
  static constexpr double kBeside = 0.1;  ///< The same in another pass.
  /// Share of missed points thick enough to stop beams.
  static constexpr double kStopsBeams = 0.5;
  static constexpr double kDependent = 0.5;   ///< Weight of a look: adjacent looks are correlated.
  static constexpr double kMost = 0.95;       ///< Upper limit of p(H), for errors of this model.
  static constexpr double kHiddenFrom = 0.2;  ///< p(H) from which a closed pass counts as hidden.
  static constexpr double kHiddenPass = 0.8;  ///< Mean p(H) of such passes.
  /// Ratio stopped_itself() / chance() of such passes.
  static constexpr double kItselfToHidden = 10.0;
  static constexpr std::uint8_t kRefuted = 0xFF;
  static constexpr unsigned kBlocked = 0x10;  ///< One look in the code.
  static constexpr unsigned kUnknown = 0x01;
  static constexpr unsigned kMostCounted = 14;  ///< Beyond it both counts are halved.

  static const std::array<float, 256>& chances() {
    static const std::array<float, 256> kTable = [] {
      std::array<float, 256> table{};
      for (std::size_t code = kBlocked; code < kRefuted; ++code)
        table[code] = posterior(static_cast<double>(code >> 4U), static_cast<double>(code & 0xFU));
      return table;
    }();
    return kTable;
  }
  static float posterior(double blocked, double unknown) {
    const double ratio = std::pow(kInFront / kBeside, kDependent * blocked) *
                         std::pow((1.0 - kInFront) / (1.0 - kBeside), kDependent * unknown);
    const double odds = kPrior / (1.0 - kPrior) * ratio;
    return static_cast<float>(std::min(kMost, odds / (1.0 + odds)));
  }

  /// Number of looks: blocked in the upper four bits, unknown in the lower.
  std::uint8_t code_ = 0;
};

}  // namespace understory::existence
