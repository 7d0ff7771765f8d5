// Index of viewpoints by position.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace understory::geoslam_mapper::smoothing {

/// Numbered points in square cells of 10 m: small moves of points rarely change a cell. Each change
/// costs as much as it touches.
class ViewpointGrid {
 public:
  /// Adds or moves a point.
  void put(std::uint32_t number, const Eigen::Vector2d& position_m) {
    const std::uint64_t cell = cell_of(position_m);
    if (cells_of_.size() <= number) cells_of_.resize(number + 1);
    if (cells_of_[number] == cell) return;
    remove(number);
    cells_[cell].push_back(number);
    cells_of_[number] = cell;
  }

  /// Removes a point, if it is there.
  void remove(std::uint32_t number) {
    if (number >= cells_of_.size() || !cells_of_[number]) return;
    const auto cell = cells_.find(*cells_of_[number]);
    cells_of_[number].reset();
    std::erase(cell->second, number);
    if (cell->second.empty()) cells_.erase(cell);
  }

  /// Calls f(number) for every point of the cells within `radius_m` of `centre_m`; also for some
  /// points beyond.
  template <typename F>
  void for_each_near(const Eigen::Vector2d& centre_m, double radius_m, F&& f) const {
    const Eigen::Vector2d reach(radius_m, radius_m);
    const auto [x0, y0] = indices_of(centre_m - reach);
    const auto [x1, y1] = indices_of(centre_m + reach);
    for (std::int32_t x = x0; x <= x1; ++x) {
      for (std::int32_t y = y0; y <= y1; ++y) {
        const auto cell = cells_.find(key(x, y));
        if (cell == cells_.end()) continue;
        for (const std::uint32_t number : cell->second) f(number);
      }
    }
  }

 private:
  static constexpr double kCell_m = 10.0;
  static std::pair<std::int32_t, std::int32_t> indices_of(const Eigen::Vector2d& p) {
    return {static_cast<std::int32_t>(std::floor(p.x() / kCell_m)),
            static_cast<std::int32_t>(std::floor(p.y() / kCell_m))};
  }
  static std::uint64_t key(std::int32_t x, std::int32_t y) {
    return (std::uint64_t{static_cast<std::uint32_t>(x)} << 32U) | static_cast<std::uint32_t>(y);
  }
  static std::uint64_t cell_of(const Eigen::Vector2d& p) {
    const auto [x, y] = indices_of(p);
    return key(x, y);
  }

  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
  std::vector<std::optional<std::uint64_t>> cells_of_;  ///< By number; none: not in the grid.
};

}  // namespace understory::geoslam_mapper::smoothing
