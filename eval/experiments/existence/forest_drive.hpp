// One drive through a surveyed forest, look by look.
#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "eval/experiments/existence/forest.hpp"

namespace understory::eval::experiments::existence {

/// Stems by squares as wide as the sensor's range.
class StemGrid {
 public:
  StemGrid(const std::vector<CensusStem>& stems, double range_m);
  /// Indices of all stems within range of a place, and of some beyond.
  std::vector<std::uint32_t> near(const Eigen::Vector2f& place_m) const;

 private:
  std::pair<int, int> cell_of(const Eigen::Vector2f& place_m) const;

  double range_m_;
  std::map<std::pair<int, int>, std::vector<std::uint32_t>> cells_;
};

/// A stem as it is seen from above.
struct StemInView {
  std::uint32_t stem = 0;
  float distance_m = 0.0F;
  float bearing = 0.0F;     ///< In the plot's frame [rad].
  float half_width = 0.0F;  ///< Angle [rad].
};

/// Which stems it can see at all is drawn when it begins; each scan then draws what it sees. Keeps
/// references to what it is given.
class ForestDrive {
 public:
  ForestDrive(const std::vector<CensusStem>& stems, const StemGrid& grid,
              const ForestSetting& setting, bool is_later, std::mt19937_64& random);

  /// Looks from one more place.
  void scan(const Eigen::Vector2f& place_m);
  /// The drive with its truth; there are no looks left then.
  DriveLooks finish(double time_s);

  /// Looks so far.
  const std::vector<LookEvent>& looks() const { return drive_.looks; }
  /// Stems within range of the last place, nearest first; also those that do not stand.
  const std::vector<StemInView>& view() const { return view_; }
  /// Whether a stem stands during this drive.
  bool stands(std::size_t stem) const { return stems_[stem].stands(is_later_); }

 private:
  double unit() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
  void find_view(const Eigen::Vector2f& place_m);
  bool is_hidden(std::size_t index) const;

  const std::vector<CensusStem>& stems_;
  const StemGrid& grid_;
  const ForestSetting& setting_;
  bool is_later_;
  std::mt19937_64& random_;
  std::vector<StemInView> view_;
  DriveLooks drive_;
  std::vector<bool> can_be_seen_;
  std::vector<int> clear_;                 ///< Looks with a free line of sight, by stem.
  std::vector<std::uint32_t> directions_;  ///< Of them, as bits of eighths.
};

}  // namespace understory::eval::experiments::existence
