#include "common/existence/decay_rate.hpp"

#include <cmath>
#include <stdexcept>

#include "common/existence/odds.hpp"

namespace understory::existence {

DecayRate::DecayRate(double rate_per_s, double weight) : mean_per_s_(rate_per_s) {
  if (weight <= 0.0 || rate_per_s <= 0.0) return;
  went_ = weight;
  exposure_s_ = weight / rate_per_s;
}

double DecayRate::sigma_per_s() const { return went_ > 0.0 ? std::sqrt(went_) / exposure_s_ : 0.0; }

void DecayRate::record(double before, double after, double dt_s) {
  if (went_ <= 0.0 || !(dt_s > 0.0)) return;
  // Three pasts: there at both ends (after), gone before, or went in between:
  //   p(went | looks) = (1 - after) P0 lost / (1 - P0 (1 - lost)), P0 (1 - lost) = before.
  const double lost = lost_share(mean_per_s_, dt_s);
  const double at_start = std::fmin(1.0, before / (1.0 - lost));
  const double gone = 1.0 - before;
  const double went = gone > 0.0 ? (1.0 - after) * at_start * lost / gone : 0.0;
  went_ += went;
  exposure_s_ += (after + 0.5 * went) * dt_s;
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
