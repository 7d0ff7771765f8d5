// Percentiles of durations in bounded memory.
#pragma once

#include <array>
#include <cstdint>

namespace understory::bus {

/// Logarithmic buckets, 16 per octave: a percentile is too large by at most 1/16 of its value.
class LatencyHistogram {
 public:
  /// Counts one duration; a negative one as 0.
  void add(std::int64_t microseconds);
  /// Upper bound of the bucket that holds the quantile (0..1); 0 when empty, never above max().
  std::int64_t quantile(double q) const;
  /// The longest duration [us]; 0 when empty.
  std::int64_t max() const { return max_; }
  /// Number of durations.
  std::uint64_t count() const { return count_; }
  /// Adds the counts of another histogram.
  void merge(const LatencyHistogram& other);

 private:
  static constexpr std::size_t kPerOctave = 16;
  static constexpr std::size_t kBuckets = 40 * kPerOctave;
  static std::size_t bucket(std::uint64_t value);
  static std::int64_t upper_bound(std::size_t bucket);

  std::array<std::uint32_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  std::int64_t max_ = 0;
};

}  // namespace understory::bus
