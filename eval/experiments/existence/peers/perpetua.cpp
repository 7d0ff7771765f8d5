#include "eval/experiments/existence/peers/perpetua.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace understory::eval::experiments::existence::peers {
namespace {

/// Of one feature and component: probability of its outputs, and the same times the survival time.
struct Expected {
  double evidence = 0.0;
  double time_s = 0.0;
};

/// Sums over the intervals in which the feature may have gone. `likelihoods[i]`: of all outputs if
/// it went between drive i and i + 1, which begin at `times`.
Expected expected_of(double rate_per_s, const std::vector<double>& times,
                     const std::vector<double>& likelihoods) {
  Expected expected;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double from = std::exp(-rate_per_s * times[i]);
    const double to = i + 1 < times.size() ? std::exp(-rate_per_s * times[i + 1]) : 0.0;
    const double next_s = i + 1 < times.size() ? times[i + 1] : 0.0;
    const double mean = from * (times[i] + 1.0 / rate_per_s) - to * (next_s + 1.0 / rate_per_s);
    expected.evidence += likelihoods[i] * (from - to);
    expected.time_s += likelihoods[i] * mean;
  }
  return expected;
}

/// Likelihoods of expected_of(), over the largest of them.
std::vector<double> likelihoods_of(const std::vector<SightingsOfDrive>& drives) {
  std::vector<double> logs(drives.size(), 0.0);
  for (std::size_t i = 0; i < drives.size(); ++i)
    for (std::size_t k = 0; k < drives.size(); ++k)
      logs[i] += k <= i ? drives[k].log_if_there : drives[k].log_if_gone;
  const double most = *std::max_element(logs.begin(), logs.end());
  for (double& log : logs) log = std::exp(log - most);
  return logs;
}

}  // namespace

RateMixture em_step(const RateMixture& mixture,
                    const std::vector<std::vector<SightingsOfDrive>>& features) {
  const std::size_t components = mixture.weights.size();
  std::vector<double> members(components, 0.0), time_s(components, 0.0);
  for (const auto& drives : features) {
    std::vector<double> times;
    times.reserve(drives.size());
    for (const SightingsOfDrive& drive : drives)
      times.push_back(drive.time_s - drives.front().time_s);
    const std::vector<double> likelihoods = likelihoods_of(drives);
    std::vector<Expected> each;
    double evidence = 0.0;
    for (std::size_t k = 0; k < components; ++k) {
      each.push_back(expected_of(mixture.rates_per_s[k], times, likelihoods));
      evidence += mixture.weights[k] * each.back().evidence;
    }
    for (std::size_t k = 0; k < components; ++k) {
      members[k] += mixture.weights[k] * each[k].evidence / evidence;
      time_s[k] += mixture.weights[k] * each[k].time_s / evidence;
    }
  }

  RateMixture next = mixture;
  for (std::size_t k = 0; k < components; ++k) {
    next.weights[k] = std::max(1e-6, members[k] / static_cast<double>(features.size()));
    next.rates_per_s[k] = std::clamp(members[k] / time_s[k], 1e-12, 1e3);
  }
  return next;
}

FilterMixture::FilterMixture(const RateMixture& mixture, double begin_s, bool is_emergence)
    : weights_(mixture.weights), is_emergence_(is_emergence) {
  for (const double rate : mixture.rates_per_s) filters_.emplace_back(rate, begin_s);
}

void FilterMixture::update(double time_s, bool is_seen, double missed, double false_rate) {
  for (PersistenceFilter& filter : filters_) {
    if (is_emergence_)
      filter.observe(time_s, is_seen, 1.0 - false_rate, 1.0 - missed);
    else
      filter.observe(time_s, is_seen, missed, false_rate);
  }
}

std::vector<double> FilterMixture::posterior() const {
  std::vector<double> logs;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < filters_.size(); ++k) {
    logs.push_back(std::log(weights_[k]) + filters_[k].log_evidence());
    most = std::max(most, logs.back());
  }
  double sum = 0.0;
  for (double& log : logs) sum += log = std::exp(log - most);
  for (double& weight : logs) weight /= sum;
  return logs;
}

double FilterMixture::predict(double time_s) const {
  const std::vector<double> weights = posterior();
  const auto best = std::max_element(weights.begin(), weights.end()) - weights.begin();
  const double p = filters_[static_cast<std::size_t>(best)].predict(time_s);
  return is_emergence_ ? 1.0 - p : p;
}

std::vector<double> FilterMixture::next_weights(const std::vector<double>& prior,
                                                double share) const {
  std::vector<double> weights = posterior();
  for (std::size_t k = 0; k < weights.size(); ++k)
    weights[k] = (1.0 - share) * weights[k] + share * prior[k];
  return weights;
}

Perpetua::Perpetua(const RateMixture& persistence, const RateMixture& emergence, double begin_s)
    : persistence_(persistence),
      emergence_(emergence),
      persisting_(persistence, begin_s, false),
      emerging_(emergence, begin_s, true) {}

void Perpetua::update(double time_s, bool is_seen, double missed, double false_rate) {
  const double belief = predict(time_s);
  if (is_persisting_ && belief <= kLow) {
    const RateMixture next{emergence_.rates_per_s,
                           emerging_.next_weights(emergence_.weights, kPriorShare)};
    emerging_ = FilterMixture(next, time_s, true);
    is_persisting_ = false;
  } else if (!is_persisting_ && belief >= kHigh) {
    const RateMixture next{persistence_.rates_per_s,
                           persisting_.next_weights(persistence_.weights, kPriorShare)};
    persisting_ = FilterMixture(next, time_s, false);
    is_persisting_ = true;
  }
  persisting_.update(time_s, is_seen, missed, false_rate);
  if (!is_persisting_) emerging_.update(time_s, is_seen, missed, false_rate);
}

double Perpetua::predict(double time_s) const {
  return is_persisting_ ? persisting_.predict(time_s) : emerging_.predict(time_s);
}

}  // namespace understory::eval::experiments::existence::peers
