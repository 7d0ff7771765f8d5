// The rate at which points of a map cease to exist, learned from drives that come back.
#pragma once

namespace understory::existence {

/// What a point adds to the counts since it was last surely seen.
struct DecayEvidence {
  float went = 0.0F;     ///< Probability that it went since then: 1 - P.
  float since_s = 0.0F;  ///< How long ago that was.
};

/// Gamma posterior over lambda: points that went, over the time that points were there. A point
/// that may have gone counts for what it may, until more is known: then what it counted is taken
/// back (EM, one point at a time, with the posterior of now and not of then).
class DecayRate {
 public:
  /// `weight`: what the start value counts for, in points that went; 0: it stays as it is.
  DecayRate(double rate_per_s, double weight);

  /// lambda [1/s]: what it is held at, else the posterior's mean.
  double mean_per_s() const { return held_per_s_ > 0.0 ? held_per_s_ : mean_per_s_; }
  /// 0: at nothing.
  void hold(double rate_per_s) { held_per_s_ = rate_per_s; }
  bool is_learned() const { return went_ > 0.0; }
  /// Its standard deviation [1/s]; 0 where the rate is not learned.
  double sigma_per_s() const;

  /// What a point's evidence was and is. When it is surely seen, `is` is {0, since} and its next
  /// `was` is {}.
  void replace(const DecayEvidence& was, const DecayEvidence& is);

  double went() const { return went_; }              ///< Expected points.
  double exposure_s() const { return exposure_s_; }  ///< Point seconds.
  /// As they were saved. Throws std::invalid_argument where they cannot be.
  void restore(double went, double exposure_s);

 private:
  double went_ = 0.0;
  double exposure_s_ = 0.0;
  double mean_per_s_;
  double held_per_s_ = 0.0;
};

}  // namespace understory::existence
