// A point as plain numbers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "common/existence/missed_share.hpp"
#include "common/existence/pass_occluder.hpp"
#include "common/existence/shell.hpp"

namespace understory::existence {

/// The complete state of a point as plain numbers without padding: equal points have equal bytes,
/// and a restored point continues bit by bit as if it had not been saved.
template <Shell S>
struct SavedPoint {
  /// Version 1 had a coarser 1 - v and no returns in front of the point; version 2 lacked the
  /// sectors of sightings and the hidden share; version 3 counted hidden passes with the others.
  static constexpr std::uint32_t kVersion = 4;
  static constexpr std::size_t kFloats = 8;
  std::uint32_t version = kVersion;
  std::uint32_t shell_kind = S::kKind;
  double odds = 0.0;  ///< P / (1 - P) in the open pass.
  /// Number of the pass, sectors and flags; and a fourth value 0 if the size were not a multiple of
  /// 8.
  std::array<std::uint32_t, 3 + (3 + kFloats + S::kNumbers) % 2> pass{};
  std::array<float, kFloats> numbers{};  ///< Numbers of the pass; see PointExistence.
  std::array<float, S::kNumbers> shell{};

  /// Whether version and shell are known and the numbers are possible.
  bool can_be() const {
    const auto is_possible = [](double number) { return std::isfinite(number) && number >= 0.0; };
    return version >= 1 && version <= kVersion && shell_kind == S::kKind && is_possible(odds) &&
           std::all_of(numbers.begin(), numbers.end(), is_possible);
  }
  /// A number with two values: 8 bits above 16.
  std::uint32_t packed(std::size_t number) const {
    return static_cast<std::uint32_t>(std::min(16777215.0F, numbers[number]));
  }
  /// Passes that missed the point and were not hidden, and the hidden ones.
  std::uint32_t pending_missed(std::uint32_t end) const {
    const std::uint32_t both = packed(3) & 0xFFFFU;
    return version < 4 ? std::min(both, end - 1) : both % end;
  }
  std::uint32_t pending_hidden(std::uint32_t end) const {
    return version < 4 ? 0 : (packed(3) & 0xFFFFU) / end;
  }
  MissedShare missed_share() const {
    constexpr std::uint32_t kFiner = MissedShare::kCodesPerOctave / 32;
    return MissedShare::of(version == 1 ? kFiner * (pass[2] >> 24U) : pass[0] >> 16U);
  }
  PassOccluder occluder() const {
    return PassOccluder::of(version == 1 ? 0 : static_cast<std::uint8_t>(pass[2] >> 24U));
  }
};

}  // namespace understory::existence
