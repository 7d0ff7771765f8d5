// The detector's recall, learned from points that surely exist.
#pragma once

#include <array>
#include <cstddef>

#include "common/existence/parameters.hpp"

namespace understory::existence {

/// Hits and misses with a Beta prior, with forgetting beyond 1e5 (so that 1e9 looks keep precision,
/// and the detector may change).
struct BetaCounts {
  double hits = 0.0;
  double misses = 0.0;
  double mean() const { return hits / (hits + misses); }
  double total() const { return hits + misses; }
  void add(double more_hits, double more_misses);
};

/// Recall on two levels. A look at a visible point sees it with p_d, which depends on the range;
/// but the looks of one pass share a cause (bark, light, the angle of the road), so a pass can see
/// a point only with probability v. Both are learned without survivor bias:
///   - a look counts for p_d where the previous look from the same viewpoint in the same pass was a
///     hit: it is selected before its outcome is known;
///   - a pass counts for v with the probability that the point existed then: first the probability
///     after the pass, later 1 if another pass surely sees the point, 0 if it was removed. Earlier
///     counts are then corrected (EM). The pass that found the point does not count.
class DetectorRecall {
 public:
  static constexpr std::size_t kBins = 8;  ///< Bins of the range, the last one unbounded.

  explicit DetectorRecall(const Parameters& parameters);

  /// p_d at a distance [m]: from the bin's own looks and, with the weight of 20 looks, those of all
  /// ranges.
  double at(double distance_m) const {
    const BetaCounts& bin = bins_[bin_of(distance_m)];
    const double q1 = (bin.hits + kShared * all_mean_) / (bin.total() + kShared);
    return q1 < least_q1_ ? kLeast : (q1 - false_rate_) * inverse_;
  }
  /// v: the value of hold(), else from the counts.
  double of_pass() const { return held_ > 0.0 ? held_ : pass_mean_; }
  /// Fixes v; 0: not fixed.
  void hold(double pass_recall) { held_ = pass_recall; }
  bool learns_passes() const { return learns_passes_; }

  void record_look(double distance_m, bool is_hit);
  /// Adds to the counts of passes; negative values correct earlier ones.
  void record_passes(double seen, double missed);

  /// For save and load: looks of all ranges, passes, then looks by range; see
  /// DetectorRecall::restore().
  static constexpr std::size_t kNumbers = 2 * (kBins + 2);
  std::array<double, kNumbers> store() const;
  /// Throws std::invalid_argument where a count is not finite or below 0.
  void restore(const std::array<double, kNumbers>& numbers);

 private:
  static constexpr double kShared = 20.0;
  static constexpr double kLeast = 0.01;

  std::size_t bin_of(double distance_m) const {
    const auto bin = static_cast<std::size_t>(distance_m * bins_per_m_);
    return bin < kBins ? bin : kBins - 1;
  }
  void refresh();

  BetaCounts all_;
  BetaCounts passes_;
  std::array<BetaCounts, kBins> bins_{};
  double all_mean_ = 0.0;
  double pass_mean_ = 0.0;
  double held_ = 0.0;
  double bins_per_m_;
  double false_rate_;
  double inverse_;
  double least_q1_;
  bool learns_;
  bool learns_passes_;
};

}  // namespace understory::existence
