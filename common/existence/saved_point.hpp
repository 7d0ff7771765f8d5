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

/// All that is kept of a point, as plain numbers without padding: the same bytes for the same
/// point, and a point that goes on bit by bit as if nothing had been.
template <Shell S>
struct SavedPoint {
  /// Version 1 had a coarser 1 - v, and nothing of what was measured in front of the point; 2 not
  /// from where a pass had seen it, nor what may hide it; 3 counted hidden passes with the others.
  static constexpr std::uint32_t kVersion = 4;
  static constexpr std::size_t kFloats = 8;
  std::uint32_t version = kVersion;
  std::uint32_t shell_kind = S::kKind;
  double odds = 0.0;  ///< P / (1 - P), of the pass that is open.
  /// Number of the pass, sectors and flags; a fourth one, 0, where the size would not divide by 8.
  std::array<std::uint32_t, 3 + (3 + kFloats + S::kNumbers) % 2> pass{};
  std::array<float, kFloats> numbers{};  ///< Of the pass; see PointExistence.
  std::array<float, S::kNumbers> shell{};

  /// Whether it is of a version and a shell that are known, and its numbers are possible.
  bool can_be() const {
    const auto is_possible = [](double number) { return std::isfinite(number) && number >= 0.0; };
    return version >= 1 && version <= kVersion && shell_kind == S::kKind && is_possible(odds) &&
           std::all_of(numbers.begin(), numbers.end(), is_possible);
  }
  /// A number that holds two: 8 bits above 16.
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
