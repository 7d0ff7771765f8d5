// Start points of searches: for a position, a landmark that is probably close.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>

namespace understory::hierarchy {

/// Stores one landmark slot per square cell. The result is only a hint: it may be outdated (the
/// caller checks that the slot is in use) and affects only the length of a search.
class LocationHints {
 public:
  /// Stores `slot` for the cell of this position.
  void remember(const Eigen::Vector2d& position_m, std::uint32_t slot) {
    cells_[key(cell(position_m.x()), cell(position_m.y()))] = slot;
  }
  /// Replaces `slot` by `replacement` if `slot` is stored for this position.
  void forget(const Eigen::Vector2d& position_m, std::uint32_t slot,
              std::optional<std::uint32_t> replacement) {
    const auto found = cells_.find(key(cell(position_m.x()), cell(position_m.y())));
    if (found == cells_.end() || found->second != slot) {
      return;
    }
    if (replacement) {
      found->second = *replacement;
    } else {
      cells_.erase(found);
    }
  }
  /// A slot from the position's own cell or one of the eight around it.
  std::optional<std::uint32_t> near(const Eigen::Vector2d& position_m) const {
    const std::int64_t x = cell(position_m.x());
    const std::int64_t y = cell(position_m.y());
    if (const auto own = cells_.find(key(x, y)); own != cells_.end()) {
      return own->second;
    }

    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        if (const auto found = cells_.find(key(x + dx, y + dy)); found != cells_.end()) {
          return found->second;
        }
      }
    }

    return std::nullopt;
  }

 private:
  /// A few tree spacings: most cells of a forest contain a landmark, and the search from it is
  /// short.
  static constexpr double kCellSize = 16.0;  // [m]

  static std::int64_t cell(double coordinate_m) {
    constexpr double kLimit = 1e9;  // keeps the conversion defined for any finite coordinate
    return static_cast<std::int64_t>(
        std::floor(std::fmin(std::fmax(coordinate_m / kCellSize, -kLimit), kLimit)));
  }
  static std::uint64_t key(std::int64_t x, std::int64_t y) {
    return (static_cast<std::uint64_t>(x) << 32U) ^ (static_cast<std::uint64_t>(y) & 0xffffffffU);
  }

  std::unordered_map<std::uint64_t, std::uint32_t> cells_;
};

}  // namespace understory::hierarchy
