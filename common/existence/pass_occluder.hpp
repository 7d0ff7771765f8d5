// Whether something hides a point all along a pass, by what was measured along the rays.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/existence/look.hpp"

namespace understory::existence {

/// Hidden variable H of a pass: something stands in front of the point from wherever it is looked
/// at. It is as likely for a point that is there as for one that is gone. Looks of a hidden pass
/// measure a return in front with kInFront, else nothing, as at the edge of what hides the point;
/// those of another pass with kBeside, past single things. A pass whose line of sight was free once
/// is not hidden; neither is one that never measured anything in front: what hides a point there is
/// known by directions alone. Hits do not count: they speak for themselves. 8 bits.
class PassOccluder {
 public:
  /// After a look that did not see the point, by what was measured along its ray.
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
  /// What the looks say of a point that is there, that no occluder hides and that the detector
  /// misses, by what they say of one that is gone, hidden or not. It stops the beams itself, where
  /// it is not too thin for them, and what is gone does not. 1 without a return in front.
  double stopped_itself() const {
    const double hidden = static_cast<double>(chance());
    const double by_itself = hidden * (1.0 - kPrior) / kPrior;
    return 1.0 - hidden + kStopsBeams * std::max(0.0, by_itself - (1.0 - hidden));
  }
  /// Whether a pass that is over and did not see the point was rather hidden than not: one of those
  /// that missed_when_hidden() is about.
  bool is_hidden_pass() const { return static_cast<double>(chance()) >= kHiddenFrom; }
  /// chance() + stopped_itself() * missed_share for a pass like that, whatever its returns were.
  /// Their ratio hardly differs, and this one goes to no end where v goes to 1.
  static double missed_when_hidden(double missed_share) {
    return kHiddenPass * (1.0 + kItselfToHidden * missed_share);
  }
  /// The part of it that the detector missed.
  static double missed_itself(double missed_share) {
    return kItselfToHidden * missed_share / (1.0 + kItselfToHidden * missed_share);
  }
  /// Whether a return in front of the point or behind it was measured, or it was found.
  bool has_told() const { return code_ >= kBlocked; }
  /// Whether no look has come yet.
  bool is_new() const { return code_ == 0; }

  /// For save and load: any byte is a state.
  std::uint8_t code() const { return code_; }
  static PassOccluder of(std::uint8_t code) {
    PassOccluder result;
    result.code_ = code;
    return result;
  }

 private:
  static constexpr double kPrior = 0.05;      ///< p(H).
  static constexpr double kInFront = 0.7;     ///< Looks with a return in front, of a hidden pass,
  static constexpr double kBeside = 0.1;      ///< and of another one.
  static constexpr double kStopsBeams = 0.5;  ///< Share of the missed points that are thick enough.
  static constexpr double kDependent = 0.5;   ///< What a look counts for: neighbours are alike.
  static constexpr double kMost = 0.95;       ///< Of p(H): this model is not all.
  static constexpr double kHiddenFrom = 0.2;  ///< p(H) of a hidden pass, when it is over,
  static constexpr double kHiddenPass = 0.8;  ///< and what it is in the mean.
  static constexpr double kItselfToHidden = 10.0;  ///< stopped_itself() by chance() there.
  static constexpr std::uint8_t kRefuted = 0xFF;
  static constexpr unsigned kBlocked = 0x10;  ///< One look in the code.
  static constexpr unsigned kUnknown = 0x01;
  static constexpr unsigned kMostCounted = 14;  ///< Then both halve, and their ratio stays.

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

  std::uint8_t code_ = 0;  ///< Looks: blocked in the upper four bits, unknown in the lower.
};

}  // namespace understory::existence
