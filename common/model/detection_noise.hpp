// The noise of detections as the scans themselves show it, beside what their sender states.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"
#include "common/model/variogram.hpp"

namespace understory::model {

/// When stated covariances are replaced.
struct DetectionNoiseParameters {
  bool learn = true;           ///< False: covariances stay as stated.
  double replace_above = 1.5;  ///< Factor of the variance from which understated ones grow.
  double replace_below = 0.6;  ///< Factor of the variance below which overstated ones shrink.
  double replace_corners_below = 0.6;  ///< The same of corners.
};

/// How the vehicle moved between two scans, by landmarks that both observed and nothing else.
struct ScanMotion {
  Utime then_utime = 0;
  Utime now_utime = 0;
  geometry::SE2WithCovariance then_T_now;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.then_utime, s.now_utime, s.then_T_now);
  }
};

/// Learns by which factor the variance of detections differs from what LANDMARKS states, for each
/// kind and range.
///
/// Two scans a few scans apart that observed the same landmarks differ by a rigid motion and by
/// noise. What the best motion leaves is the noise alone: no odometry, no map and no filter takes
/// part, so that their errors do not pass for noise.
///
/// Errors of neighbouring scans are correlated where their clouds overlap or a trunk is no circle.
/// The residual of a pair grows with the lag between its scans then (a variogram, Matheron 1963):
/// half the mean square at lag h is the variance less the autocovariance at h. The factor is that
/// of white noise of the same power at frequency zero: the variance plus twice the sum of all
/// autocovariances. N scans weighted by it state the uncertainty that their mean truly has. Errors
/// that all scans share (an offset of the mounting, the scale of ranges) are not seen; that is why
/// a statement is trusted as long as the scans do not contradict it clearly, and why variances
/// do not shrink where errors outlast the lags that are compared.
class DetectionNoise {
 public:
  /// The stated covariances hold.
  explicit DetectionNoise(const DetectionNoiseParameters& parameters = {})
      : parameters_(parameters) {}

  /// Takes a scan with its covariances as stated. `tracks`: the landmark of each detection, by any
  /// number that lasts from scan to scan; 0 = unknown. Cost O(n log n).
  void add(const LandmarkScan& scan, std::span<const std::uint64_t> tracks);
  /// The motion over up to 20 scans to the last one; nothing where they have too little in common.
  /// Cost: a fit, as in add().
  std::optional<ScanMotion> motion() const { return motion_over(kLongLag); }
  /// The same over up to so many scans.
  std::optional<ScanMotion> motion_over(std::size_t most_scans) const;
  /// The motion from the scan before the last one to that.
  std::optional<ScanMotion> step() const { return motion_over(1); }
  /// Detections of the last scan that can be found again.
  std::size_t seen_last() const { return recent_.empty() ? 0 : recent_.back().seen.size(); }
  /// The factor of the variance at this range [m]; 1 where the stated covariance is kept.
  double factor(LandmarkKind kind, double range_m) const;
  /// The scan with its covariances in the plane multiplied by their factors.
  LandmarkScan corrected(LandmarkScan scan) const;
  /// True until enough scans were compared to contradict what is stated.
  bool is_new() const;
  /// Factors of the variance to try where too little is learned: as stated it may be too small to
  /// find any landmark again, or so large that each fits several. Empty once enough is learned.
  std::span<const double> tries() const;
  /// The scan with covariances for such a try.
  static LandmarkScan rescaled(LandmarkScan scan, double factor);
  /// Whether noise of that size explains what the scan has in common with the one before it: pairs
  /// by chance fill a wide gate evenly, noise does not.
  bool explains(const LandmarkScan& scan, std::span<const std::uint64_t> tracks,
                double factor) const;
  /// How many detections of this scan are in the one before it.
  std::size_t in_common(const LandmarkScan& scan, std::span<const std::uint64_t> tracks) const;
  /// Tracking broke off: what little was learned may be from wrong pairs.
  void forget_while_new() {
    if (!is_new()) return;
    sums_ = {};
    update_factors();
  }
  /// True where the factor of any kind and range is not 1.
  bool is_misstated() const;
  /// True while it is so and the factors are not settled: less than 200 scans ago their mean over a
  /// scan doubled or halved. Afterwards what is stated is wrong, and what is used is right.
  bool is_adjusting() const { return is_misstated() && scans_since_told_ < kSettled; }
  /// How much more a detection's variance counts since its error is correlated with those of the
  /// scans around: white noise of the same power over the variance between scans four apart. 1 for
  /// white noise and until enough is learned.
  double repetition(LandmarkKind kind) const;

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.sums_, self.by_lag_, self.since_other_, self.recent_, self.told_,
      self.scans_since_told_);
    if constexpr (Archive::kReads) self.update_factors();
  }

 private:
  /// Scans over which motion() goes: the longer the way, the more it shows.
  static constexpr std::size_t kLongLag = 20;

  /// Lags [scans] at which residuals are compared; the last one is within kLongLag.
  static constexpr std::array<std::size_t, 5> kLags = {1, 2, 4, 8, 16};

  /// Degrees of freedom of a few scans.
  static constexpr double kFewScans = 300.0;

  /// Scans after which factors that did not change are settled.
  static constexpr std::size_t kSettled = 200;

  static constexpr std::size_t kKinds = 2;
  static constexpr std::size_t kRanges = 4;
  static constexpr std::size_t kBins = kKinds * kRanges;

  /// A factor of the variance for each bin of kind and range.
  using Factors = std::array<double, kBins>;
  /// All factors are 1.
  static constexpr Factors stated() {
    Factors factors{};
    factors.fill(1.0);
    return factors;
  }

  /// A detection of an earlier scan.
  struct Seen {
    std::uint64_t track = 0;
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
    LandmarkKind kind = LandmarkKind::kTrunk;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.track, self.position_m, self.covariance_m2, self.kind);
    }
  };
  /// One landmark in two scans.
  struct Pair {
    Seen then;
    Seen now;
    std::size_t bin = 0;
  };
  /// What a motion leaves of a pair, by the noise as learned so far.
  struct Residual {
    double chi2 = 0.0;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< About the motion.
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  };
  /// The motion between two scans.
  struct Fit {
    geometry::SE2 then_T_now;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };
  /// Of the squared residuals by their stated covariances.
  struct Sums {
    double chi2 = 0.0;
    double degrees = 0.0;  ///< Of freedom.

    /// 1 until a few scans are known.
    double mean() const { return (kFewScans + chi2) / (kFewScans + degrees); }
    /// What is older counts less.
    void forget_beyond(double memory) {
      if (degrees <= memory) return;
      chi2 *= memory / degrees;
      degrees = memory;
    }

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.chi2, self.degrees);
    }
  };

  /// The detections of one scan that can be found again, in order of track.
  struct SeenScan {
    Utime utime = 0;
    std::vector<Seen> seen;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.utime, self.seen);
    }
  };

  /// What a scan has in common with one before it.
  struct Common {
    Utime then_utime = 0;
    std::vector<Pair> pairs;
    Fit fit;
  };

  static std::size_t bin_of(LandmarkKind kind, double range_m);
  static std::vector<Seen> seen_in(const LandmarkScan& scan, std::span<const std::uint64_t> tracks);
  static std::vector<Pair> in_both(std::span<const Seen> then, std::span<const Seen> now);
  std::optional<Common> common_with_last(std::size_t most_scans) const;
  void learn(std::span<const Pair> pairs, const Fit& fit);
  void learn_lag(std::size_t lag);
  Sums left_over(const Pair& pair, const Fit& fit, double usual) const;
  Fit fitted_motion(std::span<const Pair> pairs) const;
  static Residual residual_of(const Pair& pair, double factor, const geometry::SE2& then_T_now);
  std::array<LagVariance, kLags.size()> variogram(LandmarkKind kind) const;
  bool may_shrink(LandmarkKind kind) const;
  double estimate(std::size_t bin) const;
  void update_estimates();
  void update_factors();
  double factor_of(std::size_t bin, bool may_shrink) const;
  void note_changes();

  DetectionNoiseParameters parameters_;
  std::array<Sums, kBins> sums_{};
  /// Of residuals at each lag, by their noise as learned in `sums_`.
  std::array<std::array<Sums, kLags.size()>, kKinds> by_lag_{};
  std::size_t since_other_ = 0;  ///< Scans since the noise was quite different.
  /// Logarithm of the mean factor of the scan that had last doubled or halved it, and scans
  /// since.
  double told_ = 0.0;
  std::size_t scans_since_told_ = 0;
  std::deque<SeenScan> recent_;  ///< The last scans, the newest at the end.
  // From the sums above, for each bin; each scan uses them for each of its detections.
  Factors estimates_ = stated();  ///< By `sums_` alone.
  Factors learned_ = stated();    ///< And by what errors repeat.
  Factors factors_ = stated();    ///< That are used: 1 where the stated covariance is kept.
};

}  // namespace understory::model
