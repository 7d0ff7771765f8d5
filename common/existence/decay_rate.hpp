// The rate at which points of a map cease to exist, learned from drives that come back.
#pragma once

namespace understory::existence {

/// Gamma posterior over lambda: points that went, over the time that points were there. Counts are
/// expected ones, so a point that may have gone counts for what it may (one step of EM per
/// interval).
class DecayRate {
 public:
  /// `weight`: what the start value counts for, in points that went; 0: it stays as it is.
  DecayRate(double rate_per_s, double weight);

  /// lambda [1/s]: the posterior's mean.
  double mean_per_s() const { return mean_per_s_; }
  /// Its standard deviation [1/s]; 0 where the rate is not learned.
  double sigma_per_s() const;

  /// An interval of one point: P before the looks at its end (time already passed), P after them,
  /// how long it was [s].
  void record(double before, double after, double dt_s);

  double went() const { return went_; }              ///< Expected points.
  double exposure_s() const { return exposure_s_; }  ///< Point seconds.
  /// As they were saved. Throws std::invalid_argument where they cannot be.
  void restore(double went, double exposure_s);

 private:
  double went_ = 0.0;
  double exposure_s_ = 0.0;
  double mean_per_s_;
};

}  // namespace understory::existence
