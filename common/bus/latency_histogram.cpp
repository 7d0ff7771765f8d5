#include "common/bus/latency_histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace understory::bus {

std::size_t LatencyHistogram::bucket(std::uint64_t value) {
  if (value < kPerOctave) return static_cast<std::size_t>(value);           // exact
  const auto octave = static_cast<std::size_t>(std::bit_width(value)) - 5;  // 16..31 -> 0
  const std::size_t within = static_cast<std::size_t>(value >> octave) - kPerOctave;
  return std::min(kPerOctave * (octave + 1) + within, kBuckets - 1);
}

std::int64_t LatencyHistogram::upper_bound(std::size_t bucket) {
  if (bucket < kPerOctave) return static_cast<std::int64_t>(bucket);
  const std::size_t octave = bucket / kPerOctave - 1;
  const std::uint64_t within = bucket % kPerOctave + kPerOctave;
  return static_cast<std::int64_t>(((within + 1) << octave) - 1);
}

void LatencyHistogram::add(std::int64_t microseconds) {
  const std::int64_t value = std::max<std::int64_t>(microseconds, 0);
  ++buckets_[bucket(static_cast<std::uint64_t>(value))];
  ++count_;
  max_ = std::max(max_, value);
}

std::int64_t LatencyHistogram::quantile(double q) const {
  const auto rank = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_))));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    seen += buckets_[i];
    if (seen >= rank) return std::min(upper_bound(i), max_);
  }
  return max_;
}

void LatencyHistogram::merge(const LatencyHistogram& other) {
  for (std::size_t i = 0; i < kBuckets; ++i) buckets_[i] += other.buckets_[i];
  count_ += other.count_;
  max_ = std::max(max_, other.max_);
}

}  // namespace understory::bus
