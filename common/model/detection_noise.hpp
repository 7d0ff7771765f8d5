// The noise of detections, estimated from the scans themselves.
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

/// Limits for replacing stated covariances.
struct DetectionNoiseParameters {
  bool learn = true;           ///< False: covariances stay as stated.
  double replace_above = 1.5;  ///< Factor of the variance above which stated ones are enlarged.
  double replace_below = 0.6;  ///< Factor of the variance below which stated ones are reduced.
  double replace_corners_below = 0.6;  ///< The same for corners.
};

/// The vehicle's motion between two scans, from common landmarks alone.
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

/// Learns the factor between the true variance of detections and the variance in LANDMARKS, for
/// each kind and range.
///
/// Two scans a few scans apart that observed the same landmarks differ by a rigid motion and by
/// noise. The residual of the best motion is noise alone: no odometry, map or filter is used, so
/// that their errors are not counted as noise.
///
/// Errors of adjacent scans are correlated where their clouds overlap or a trunk is not a circle.
/// The residual of a pair then grows with the lag between its scans (a variogram, Matheron 1963):
/// half the mean square at lag h is the variance less the autocovariance at h. The factor belongs
/// to white noise of the same power at frequency zero: the variance plus twice the sum of all
/// autocovariances. With it, the mean of N scans has its true covariance. Errors common to all
/// scans (an offset of the mounting, the scale of ranges) are not observable. Therefore stated
/// covariances are kept unless the scans contradict them clearly, and variances are not reduced
/// where errors last longer than the compared lags.
class DetectionNoise {
 public:
  /// Starts with the stated covariances.
  explicit DetectionNoise(const DetectionNoiseParameters& parameters = {})
      : parameters_(parameters) {}

  /// Takes a scan with its stated covariances. `tracks`: a number for the landmark of each
  /// detection, constant from scan to scan; 0 = unknown. Cost O(n log n).
  void add(const LandmarkScan& scan, std::span<const std::uint64_t> tracks);
  /// The motion over up to 20 scans to the last one; none where they have too few common landmarks.
  /// Cost: one fit, as in add().
  std::optional<ScanMotion> motion() const { return motion_over(kLongLag); }
  /// The same over up to `most_scans` scans.
  std::optional<ScanMotion> motion_over(std::size_t most_scans) const;
  /// The motion from the last scan but one to the last.
  std::optional<ScanMotion> step() const { return motion_over(1); }
  /// Detections of the last scan that can be found again.
  std::size_t seen_last() const { return recent_.empty() ? 0 : recent_.back().seen.size(); }
  /// The factor of the variance at this range [m]; 1 where the stated covariance is kept.
  double factor(LandmarkKind kind, double range_m) const;
  /// The scan with its covariances in the plane multiplied by their factors.
  LandmarkScan corrected(LandmarkScan scan) const;
  /// True until enough scans were compared to contradict the stated covariances.
  bool is_new() const;
  /// Factors of the variance to try while too little is learned: the stated variance may be too
  /// small to find any landmark again, or so large that each detection fits several. Empty when
  /// enough is learned.
  std::span<const double> tries() const;
  /// The scan with covariances for such a try.
  static LandmarkScan rescaled(LandmarkScan scan, double factor);
  /// Whether noise of this size explains the pairs with the previous scan: pairs by chance fill a
  /// wide gate evenly, noise does not.
  bool explains(const LandmarkScan& scan, std::span<const std::uint64_t> tracks,
                double factor) const;
  /// Number of detections of this scan that are also in the previous scan.
  std::size_t in_common(const LandmarkScan& scan, std::span<const std::uint64_t> tracks) const;
  /// Call it after a loss of tracking: the little learned so far may be from wrong pairs.
  void forget_while_new() {
    if (!is_new()) return;
    sums_ = {};
    update_factors();
  }
  /// True where the factor of any kind and range is not 1.
  bool is_misstated() const;
  /// True while is_misstated() and the factors are not settled: their mean over a scan doubled or
  /// halved less than 200 scans ago. Later the stated covariances are wrong, but the used ones are
  /// right.
  bool is_adjusting() const { return is_misstated() && scans_since_told_ < kSettled; }
  /// Factor on a detection's variance for the correlation with adjacent scans: white noise of the
  /// same power over the variance between scans four apart. 1 for white noise and until enough is
  /// learned.
  double repetition(LandmarkKind kind) const;

  /// Members of a saved state; see common/state. The parameters are configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.sums_, self.by_lag_, self.since_other_, self.recent_, self.told_,
      self.scans_since_told_);
    if constexpr (Archive::kReads) self.update_factors();
  }

 private:
  /// Scans covered by motion(): a longer distance contains more information.
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

  /// A detection of a scan.
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
  /// Residual of a pair after a motion, by the noise learned so far.
  struct Residual {
    double chi2 = 0.0;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< Information on the motion.
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  };
  /// The motion between two scans.
  struct Fit {
    geometry::SE2 then_T_now;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  };
  /// Sums of the squared residuals by their stated covariances.
  struct Sums {
    double chi2 = 0.0;
    double degrees = 0.0;  ///< Degrees of freedom.

    /// 1 until a few scans are known.
    double mean() const { return (kFewScans + chi2) / (kFewScans + degrees); }
    /// Reduces the weight of older scans.
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

  /// The detections of one scan that can be found again, sorted by track.
  struct SeenScan {
    Utime utime = 0;
    std::vector<Seen> seen;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.utime, self.seen);
    }
  };

  /// Common landmarks of a scan and an earlier one.
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
  std::size_t since_other_ = 0;  ///< Scans since the noise changed strongly.
  /// Logarithm of the mean factor at the last scan that doubled or halved it, and scans since then.
  double told_ = 0.0;
  std::size_t scans_since_told_ = 0;
  std::deque<SeenScan> recent_;  ///< The last scans, the newest at the end.
  // From the sums above, for each bin; each scan uses them for each of its detections.
  Factors estimates_ = stated();  ///< By `sums_` alone.
  Factors learned_ = stated();    ///< And by what errors repeat.
  Factors factors_ = stated();    ///< That are used: 1 where the stated covariance is kept.
};

}  // namespace understory::model
