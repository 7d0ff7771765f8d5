#include "common/existence/decay_rate.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace understory::existence {
namespace {

constexpr double kLeast = 1e-9;

}  // namespace

DecayRate::DecayRate(double rate_per_s, double weight) : mean_per_s_(rate_per_s) {
  if (weight <= 0.0 || rate_per_s <= 0.0) return;
  went_ = weight;
  exposure_s_ = weight / rate_per_s;
  mean_per_s_ = went_ / exposure_s_;  // equal to the result of restore(), to the bit
}

double DecayRate::sigma_per_s() const { return went_ > 0.0 ? std::sqrt(went_) / exposure_s_ : 0.0; }

void DecayRate::replace(const DecayEvidence& was, const DecayEvidence& is) {
  if (went_ <= 0.0) return;
  // A removed point existed for about half of one interval; this time is neglected.
  const auto exposure_s = [](const DecayEvidence& one) {
    return (1.0 - static_cast<double>(one.went)) * static_cast<double>(one.since_s);
  };
  went_ = std::max(kLeast, went_ + is.went - was.went);
  exposure_s_ = std::max(kLeast, exposure_s_ + exposure_s(is) - exposure_s(was));
  mean_per_s_ = went_ / exposure_s_;
}

void DecayRate::restore(double went, double exposure_s) {
  if (!std::isfinite(went) || !std::isfinite(exposure_s) || went < 0.0 || exposure_s < 0.0 ||
      (went > 0.0) != (exposure_s > 0.0))
    throw std::invalid_argument("decay rate: counts that cannot be");
  went_ = went;
  exposure_s_ = exposure_s;
  if (went > 0.0) mean_per_s_ = went / exposure_s;
}

}  // namespace understory::existence
