// The persistence filter (Rosen, Mason, Leonard: "Towards Lifelong Feature-Based Mapping in
// Semi-Static Environments", ICRA 2016, Algorithm 1), with an exponential prior on the survival
// time.
#pragma once

#include <cmath>

namespace understory::eval::experiments::existence::peers {

/// p(Y_1:N | T > t_N) and the partial evidence L(Y_1:N), both over one factor that is kept apart.
class PersistenceFilter {
 public:
  /// `rate_per_s`: of the survival time's exponential; `begin_s`: when the feature was first there.
  PersistenceFilter(double rate_per_s, double begin_s)
      : rate_per_s_(rate_per_s), begin_s_(begin_s), last_s_(begin_s) {}

  /// A detector's output (eq. 16-18): likelihoods of it with and without the feature.
  void update(double time_s, double if_there, double if_gone) {
    partial_ = if_gone * (partial_ + likelihood_ * (survival(last_s_) - survival(time_s)));
    likelihood_ *= if_there;
    last_s_ = time_s;
    const double scale = partial_ + likelihood_;
    partial_ /= scale;
    likelihood_ /= scale;
    log_scale_ += std::log(scale);
  }
  void observe(double time_s, bool is_seen, double missed, double false_rate) {
    update(time_s, is_seen ? 1.0 - missed : missed, is_seen ? false_rate : 1.0 - false_rate);
  }

  /// p(X_t = 1 | Y_1:N), t at or after the last output (eq. 19).
  double predict(double time_s) const {
    return likelihood_ * survival(time_s) / (partial_ + likelihood_ * survival(last_s_));
  }
  /// log p(Y_1:N).
  double log_evidence() const {
    return log_scale_ + std::log(partial_ + likelihood_ * survival(last_s_));
  }

 private:
  double survival(double time_s) const { return std::exp(-rate_per_s_ * (time_s - begin_s_)); }

  double rate_per_s_;
  double begin_s_;
  double last_s_;
  double likelihood_ = 1.0;
  double partial_ = 0.0;
  double log_scale_ = 0.0;
};

}  // namespace understory::eval::experiments::existence::peers
