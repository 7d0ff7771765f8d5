#include "common/existence/recall.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace understory::existence {
namespace {

constexpr double kMostCounts = 1e5;
constexpr double kLeastCount = 1e-3;
/// Upper limit of the recall of a look, so that one miss is never certain evidence.
constexpr double kMostRecall = 0.999;

}  // namespace

void BetaCounts::add(double more_hits, double more_misses) {
  hits += more_hits;
  misses += more_misses;
  const double excess = total() / kMostCounts;
  if (excess <= 1.0) return;
  hits /= excess;
  misses /= excess;
}

DetectorRecall::DetectorRecall(const Parameters& parameters)
    : bins_per_m_(static_cast<double>(kBins) / parameters.range_m),
      false_rate_(parameters.false_rate),
      inverse_(1.0 / (1.0 - parameters.false_rate)),
      least_q1_(parameters.false_rate + kLeast * (1.0 - parameters.false_rate)),
      learns_(parameters.learn_recall),
      learns_passes_(parameters.learn_recall && parameters.pass_recall < 1.0) {
  // Hits include false sightings: the counts estimate q1 = eps + (1 - eps) p_d.
  const double q1 = false_rate_ + (1.0 - false_rate_) * parameters.recall;
  all_ = {parameters.recall_weight * q1, parameters.recall_weight * (1.0 - q1)};
  passes_ = {parameters.pass_recall_weight * parameters.pass_recall,
             parameters.pass_recall_weight * (1.0 - parameters.pass_recall)};
  refresh();
}

void DetectorRecall::record_look(double distance_m, bool is_hit) {
  if (!learns_) return;
  const double hit = is_hit ? 1.0 : 0.0;
  all_.add(hit, 1.0 - hit);
  bins_[bin_of(distance_m)].add(hit, 1.0 - hit);
  refresh();
}

void DetectorRecall::record_passes(double seen, double missed) {
  if (!learns_passes_) return;
  passes_.add(seen, missed);
  passes_.hits = std::max(passes_.hits, kLeastCount);
  passes_.misses = std::max(passes_.misses, kLeastCount);
  refresh();
}

void DetectorRecall::refresh() {
  const double most_q1 = false_rate_ + (1.0 - false_rate_) * kMostRecall;
  all_mean_ = std::min(all_.mean(), most_q1);
  pass_mean_ = passes_.mean();
}

std::array<double, DetectorRecall::kNumbers> DetectorRecall::store() const {
  std::array<double, kNumbers> numbers{all_.hits, all_.misses, passes_.hits, passes_.misses};
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    numbers[4 + 2 * bin] = bins_[bin].hits;
    numbers[5 + 2 * bin] = bins_[bin].misses;
  }
  return numbers;
}

void DetectorRecall::restore(const std::array<double, kNumbers>& numbers) {
  for (const double number : numbers)
    if (!std::isfinite(number) || number < 0.0)
      throw std::invalid_argument("recall: a count is not finite or below 0");
  if (numbers[0] + numbers[1] <= 0.0 || numbers[2] + numbers[3] <= 0.0)
    throw std::invalid_argument("recall: there are no counts");
  all_ = {numbers[0], numbers[1]};
  passes_ = {numbers[2], numbers[3]};
  for (std::size_t bin = 0; bin < kBins; ++bin)
    bins_[bin] = {numbers[4 + 2 * bin], numbers[5 + 2 * bin]};
  refresh();
}

}  // namespace understory::existence
