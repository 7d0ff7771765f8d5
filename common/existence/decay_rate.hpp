// The rate at which points of a map cease to exist, learned from repeated drives.
#pragma once

namespace understory::existence {

/// A point's contribution to the counts since it was last surely seen.
struct DecayEvidence {
  float went = 0.0F;     ///< Probability that it was removed since then: 1 - P.
  float since_s = 0.0F;  ///< Time since then.
};

/// Gamma posterior over lambda: removed points over the time for which points existed. A point that
/// may be removed counts with its probability; when more is known, this contribution is replaced
/// (incremental EM with the present posterior).
class DecayRate {
 public:
  /// `weight`: weight of the start value in removed points; 0: the rate is constant.
  DecayRate(double rate_per_s, double weight);

  /// lambda [1/s]: the value of hold(), else the posterior's mean.
  double mean_per_s() const { return held_per_s_ > 0.0 ? held_per_s_ : mean_per_s_; }
  /// Fixes the rate; 0: not fixed.
  void hold(double rate_per_s) { held_per_s_ = rate_per_s; }
  bool is_learned() const { return went_ > 0.0; }
  /// Standard deviation of lambda [1/s]; 0 where the rate is not learned.
  double sigma_per_s() const;

  /// Replaces a point's evidence `was` by `is`. When the point is surely seen, `is` is {0, since}
  /// and the next `was` is {}.
  void replace(const DecayEvidence& was, const DecayEvidence& is);

  double went() const { return went_; }              ///< Expected number of removed points.
  double exposure_s() const { return exposure_s_; }  ///< Sum of existence times of the points [s].
  /// Restores saved counts. Throws std::invalid_argument where they are impossible.
  void restore(double went, double exposure_s);

 private:
  double went_ = 0.0;
  double exposure_s_ = 0.0;
  double mean_per_s_;
  double held_per_s_ = 0.0;
};

}  // namespace understory::existence
