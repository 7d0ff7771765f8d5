#include "common/model/detection_noise.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/geometry/alignment.hpp"

namespace understory::model {
namespace {

/// Lag for the noise: a scan is compared with one this many scans before; adjacent scans share more
/// of their errors.
constexpr std::size_t kLag = 4;
/// Least number of pairs, so that the motion leaves enough degrees of freedom.
constexpr std::size_t kLeastPairs = 4;
/// Largest number of pairs; of more, every second, third, ... is used.
constexpr std::size_t kMostPairs = 64;
/// Limits of the bins of range [m].
constexpr std::array<double, 3> kRangeLimits_m = {10.0, 20.0, 40.0};
/// Upper limit of chi^2 with 2 degrees of freedom, so that a wrong pair does not dominate.
constexpr double kMostChi2 = 9.0;
/// Memory in degrees of freedom for a kind and range, and for a kind and lag: the correlation of
/// errors depends on the sensor and changes less.
constexpr double kMemory = 600.0;
constexpr double kLagMemory = 8000.0;
/// Standard deviations beyond which a lag shows a correlation.
constexpr double kLagSigmas = 6.0;
/// Growth of the variogram to the longest lag above which errors last longer than the compared
/// lags.
constexpr double kMostGrowth = 0.15;
/// Weight of the stated variance, and of the whole kind for one range [degrees of freedom].
constexpr double kStatedWeight = 4.0;
constexpr double kKindWeight = 40.0;
/// A factor is used if its logarithm is this many standard deviations from zero.
constexpr double kSigmas = 4.0;
/// Passes of the fit; the second starts at the optimum except for rounding and wrong pairs.
constexpr int kPasses = 2;
/// Least variance in a division [m^2].
constexpr double kLeast_m2 = 1e-12;
/// A scan shows other noise if its mean factor differs by this ratio and by this many standard
/// deviations of its logarithm; earlier sums are then multiplied by kAfterChange.
constexpr double kOther = 2.0;
constexpr double kOtherSigmas = 4.0;
constexpr double kAfterChange = 0.3;
/// Change of the logarithm of a scan's mean factor that counts as a change.
constexpr double kChanged = 0.69;  // doubled or halved
/// Factors of the variance to try: four times the sigma, a quarter and half of it.
constexpr std::array<double, 3> kTries = {16.0, 1.0 / 16.0, 1.0 / 4.0};
/// Upper limit of a rescaled scan's chi^2 / degrees of freedom. Pairs by chance have 2 and more.
constexpr double kExplained = 1.4;
/// A pair is skipped if the motion uses nearly all its degrees of freedom.
constexpr double kLeastShare = 0.1;

/// d(then_T_now * now) / d(then_T_now), right perturbation, 2 x 3.
Eigen::Matrix<double, 2, 3> motion_jacobian(const Eigen::Matrix2d& rotation,
                                            const Eigen::Vector2d& now_m) {
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << Eigen::Matrix2d::Identity(), geometry::perpendicular(now_m);
  return rotation * jacobian;
}

bool is_other_noise(double chi2, double expected, double degrees) {
  if (degrees <= 0.0 || expected <= 0.0) return false;
  const double change = std::abs(std::log(std::max(chi2, 1e-3 * expected) / expected));
  return change > std::max(std::log(kOther), kOtherSigmas * std::sqrt(2.0 / degrees));
}

/// Every k-th element if there are too many.
template <class T>
void thin_out(std::vector<T>& values, std::size_t most) {
  if (values.size() <= most) return;
  const std::size_t step = (values.size() + most - 1) / most;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < values.size(); i += step) values[kept++] = values[i];
  values.resize(kept);
}

}  // namespace

std::size_t DetectionNoise::bin_of(LandmarkKind kind, double range_m) {
  const auto limit = std::ranges::upper_bound(kRangeLimits_m, range_m);
  return static_cast<std::size_t>(kind) * kRanges +
         static_cast<std::size_t>(limit - kRangeLimits_m.begin());
}

std::vector<DetectionNoise::Seen> DetectionNoise::seen_in(const LandmarkScan& scan,
                                                          std::span<const std::uint64_t> tracks) {
  std::vector<Seen> seen;
  for (std::size_t i = 0; i < scan.detections.size() && i < tracks.size(); ++i) {
    const Detection& one = scan.detections[i];
    const Eigen::Matrix2d covariance = one.covariance_m2.topLeftCorner<2, 2>();
    if (tracks[i] == 0 || !one.position_m.allFinite() || !covariance.allFinite()) continue;
    seen.push_back({tracks[i], one.position_m.head<2>(), covariance, one.kind});
  }
  std::ranges::sort(seen, {}, &Seen::track);
  return seen;
}

std::vector<DetectionNoise::Pair> DetectionNoise::in_both(std::span<const Seen> then,
                                                          std::span<const Seen> now) {
  std::vector<Pair> pairs;
  for (auto a = then.begin(), b = now.begin(); a != then.end() && b != now.end();) {
    if (a->track == b->track) {
      const double range_m = 0.5 * (a->position_m.norm() + b->position_m.norm());
      pairs.push_back({*a, *b, bin_of(b->kind, range_m)});
      ++a, ++b;
    } else {
      ++(a->track < b->track ? a : b);
    }
  }
  return pairs;
}

void DetectionNoise::add(const LandmarkScan& scan, std::span<const std::uint64_t> tracks) {
  recent_.push_back({scan.utime, seen_in(scan, tracks)});
  if (recent_.size() > kLongLag + 1) recent_.pop_front();
  if (!parameters_.learn) return;
  ++since_other_;
  if (const auto common = common_with_last(kLag)) learn(common->pairs, common->fit);
  for (std::size_t lag = 0; lag < kLags.size(); ++lag) learn_lag(lag);
  update_factors();
  note_changes();
}

/// Registers a change of the mean of the last scan's factors.
void DetectionNoise::note_changes() {
  scans_since_told_ = std::min(scans_since_told_ + 1, kSettled);
  const std::vector<Seen>& seen = recent_.back().seen;
  if (seen.size() < kLeastPairs) return;
  Factors logarithm{};
  for (std::size_t bin = 0; bin < kBins; ++bin) logarithm[bin] = std::log(learned_[bin]);
  double sum = 0.0;
  for (const Seen& one : seen) sum += logarithm[bin_of(one.kind, one.position_m.norm())];

  const double mean = sum / static_cast<double>(seen.size());
  if (std::abs(mean - told_) < kChanged) return;
  told_ = mean;
  scans_since_told_ = 0;
}

/// The residuals between the last scan and the one `kLags[lag]` before it.
void DetectionNoise::learn_lag(std::size_t lag) {
  const std::size_t before = kLags[lag];
  if (recent_.size() <= before || since_other_ < before) return;
  std::vector<Pair> pairs = in_both(recent_[recent_.size() - 1 - before].seen, recent_.back().seen);
  if (pairs.size() < kLeastPairs) return;
  thin_out(pairs, kMostPairs);
  const Fit fit = fitted_motion(pairs);
  if (!fit.covariance.allFinite()) return;

  // Relative to the learned noise, so that kinds and ranges are comparable.
  for (const Pair& pair : pairs) {
    Sums& sums = by_lag_[pair.bin / kRanges][lag];
    const auto [chi2, degrees] = left_over(pair, fit, sums.mean());
    sums.chi2 += chi2;
    sums.degrees += degrees;
  }
  for (std::size_t kind = 0; kind < kKinds; ++kind) by_lag_[kind][lag].forget_beyond(kLagMemory);
}

/// The residual of a pair after a motion, by the noise learned so far, and its degrees of freedom:
/// the motion uses a share of them. A residual much larger than the `usual` one is limited to
/// kMostChi2 of it; the mean is corrected for this.
DetectionNoise::Sums DetectionNoise::left_over(const Pair& pair, const Fit& fit,
                                               double usual) const {
  static const double kCut = 1.0 - std::exp(-0.5 * kMostChi2);
  const Residual residual = residual_of(pair, estimates_[pair.bin], fit.then_T_now);
  const double taken = (fit.covariance * residual.information).trace();
  const double degrees = std::max(0.0, 2.0 - taken);
  const double share = 0.5 * degrees;
  if (share < kLeastShare) return {};
  return {share * std::min(residual.chi2 / share, usual * kMostChi2) / kCut, degrees};
}

/// The oldest among the `most_scans` scans before the last one with enough common landmarks.
std::optional<DetectionNoise::Common> DetectionNoise::common_with_last(
    std::size_t most_scans) const {
  if (recent_.empty()) return std::nullopt;
  const std::size_t last = recent_.size() - 1;
  for (std::size_t i = last - std::min(most_scans, last); i < last; ++i) {
    std::vector<Pair> pairs = in_both(recent_[i].seen, recent_[last].seen);
    if (pairs.size() < kLeastPairs) continue;
    thin_out(pairs, kMostPairs);
    const Fit fit = fitted_motion(pairs);
    if (!fit.covariance.allFinite()) return std::nullopt;
    return Common{recent_[i].utime, std::move(pairs), fit};
  }
  return std::nullopt;
}

std::optional<ScanMotion> DetectionNoise::motion_over(std::size_t most_scans) const {
  const auto common = common_with_last(most_scans);
  if (!common) return std::nullopt;
  return ScanMotion{
      common->then_utime, recent_.back().utime, {common->fit.then_T_now, common->fit.covariance}};
}

void DetectionNoise::learn(std::span<const Pair> pairs, const Fit& fit) {
  std::array<Sums, kBins> added{};
  for (const Pair& pair : pairs) {
    const Sums left = left_over(pair, fit, 1.0);
    added[pair.bin].chi2 += estimates_[pair.bin] * left.chi2;
    added[pair.bin].degrees += left.degrees;
  }

  // The memory is bounded: older scans have less weight, and little where this scan is very
  // different.
  Sums all;
  double expected = 0.0;
  for (std::size_t bin = 0; bin < sums_.size(); ++bin) {
    all.chi2 += added[bin].chi2;
    all.degrees += added[bin].degrees;
    expected += estimates_[bin] * added[bin].degrees;
  }
  // Lags are not compared across a change of all noise. One range alone differs too often by
  // chance.
  if (is_other_noise(all.chi2, expected, all.degrees)) since_other_ = 0;
  for (std::size_t bin = 0; bin < sums_.size(); ++bin) {
    Sums& sums = sums_[bin];
    if (is_other_noise(added[bin].chi2, estimate(bin) * added[bin].degrees, added[bin].degrees)) {
      sums.chi2 *= kAfterChange;
      sums.degrees *= kAfterChange;
    }
    sums.chi2 += added[bin].chi2;
    sums.degrees += added[bin].degrees;
    sums.forget_beyond(kMemory);
  }
  update_estimates();
}

DetectionNoise::Residual DetectionNoise::residual_of(const Pair& pair, double factor,
                                                     const geometry::SE2& then_T_now) {
  const Eigen::Matrix2d rotation = then_T_now.rotation();
  const Eigen::Matrix2d stated =
      pair.then.covariance_m2 + rotation * pair.now.covariance_m2 * rotation.transpose();
  const Eigen::Matrix2d weight =
      (factor * stated + kLeast_m2 * Eigen::Matrix2d::Identity()).inverse();
  const Eigen::Vector2d error = pair.then.position_m - then_T_now * pair.now.position_m;
  const Eigen::Matrix<double, 2, 3> jacobian = motion_jacobian(rotation, pair.now.position_m);
  return {error.dot(weight * error), jacobian.transpose() * weight * jacobian,
          jacobian.transpose() * weight * error};
}

DetectionNoise::Fit DetectionNoise::fitted_motion(std::span<const Pair> pairs) const {
  geometry::RigidAlignment2 alignment;
  for (const Pair& pair : pairs) {
    const double variance = (pair.then.covariance_m2 + pair.now.covariance_m2).trace();
    alignment.add(pair.then.position_m, pair.now.position_m, 1.0 / std::max(variance, kLeast_m2));
  }

  Fit fit{alignment.a_T_b(), Eigen::Matrix3d::Zero()};
  for (int pass = 0; pass < kPasses; ++pass) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const Pair& pair : pairs) {
      const Residual residual = residual_of(pair, estimates_[pair.bin], fit.then_T_now);
      const double doubt = std::max(1.0, residual.chi2 / kMostChi2);
      information += residual.information / doubt;
      gradient += residual.gradient / doubt;
    }
    fit.covariance = information.inverse();
    fit.then_T_now = fit.then_T_now * geometry::SE2::Exp(fit.covariance * gradient);
  }
  return fit;
}

double DetectionNoise::estimate(std::size_t bin) const {
  const std::size_t first = bin / kRanges * kRanges;
  Sums kind{kStatedWeight, kStatedWeight};
  for (std::size_t i = first; i < first + kRanges; ++i) {
    kind.chi2 += sums_[i].chi2;
    kind.degrees += sums_[i].degrees;
  }
  const double of_kind = kind.chi2 / kind.degrees;
  const double weight = std::min(kKindWeight, kind.degrees);
  return (weight * of_kind + sums_[bin].chi2) / (weight + sums_[bin].degrees);
}

std::array<LagVariance, DetectionNoise::kLags.size()> DetectionNoise::variogram(
    LandmarkKind kind) const {
  const std::array<Sums, kLags.size()>& sums = by_lag_[static_cast<std::size_t>(kind)];
  std::array<LagVariance, kLags.size()> lags{};
  for (std::size_t i = 0; i < kLags.size(); ++i) {
    lags[i].lag = kLags[i];
    if (sums[i].degrees < kFewScans) continue;
    lags[i].value = sums[i].chi2 / sums[i].degrees;
    lags[i].degrees = sums[i].degrees;
  }
  return lags;
}

double DetectionNoise::repetition(LandmarkKind kind) const {
  return white_noise_power(variogram(kind), kLag, kLagSigmas);
}

/// Errors with a longer memory than the compared lags would appear small.
bool DetectionNoise::may_shrink(LandmarkKind kind) const {
  return !outlasts(variogram(kind), kMostGrowth);
}

void DetectionNoise::update_estimates() {
  for (std::size_t bin = 0; bin < kBins; ++bin) estimates_[bin] = estimate(bin);
}

void DetectionNoise::update_factors() {
  update_estimates();
  for (std::size_t first = 0; first < kBins; first += kRanges) {
    const auto kind = static_cast<LandmarkKind>(first / kRanges);
    const double repeated = repetition(kind);
    const bool shrinks = may_shrink(kind);
    for (std::size_t bin = first; bin < first + kRanges; ++bin) {
      learned_[bin] = estimates_[bin] * repeated;
      factors_[bin] = factor_of(bin, shrinks);
    }
  }
}

double DetectionNoise::factor_of(std::size_t bin, bool may_shrink) const {
  const double learned = learned_[bin];
  const bool is_corner = bin / kRanges == static_cast<std::size_t>(LandmarkKind::kCorner);
  const double below = is_corner ? parameters_.replace_corners_below : parameters_.replace_below;
  if (learned < parameters_.replace_above && learned > below) return 1.0;
  if (learned < 1.0 && !may_shrink) return 1.0;

  // Is the factor explained by chance?
  const std::size_t first = bin / kRanges * kRanges;
  double degrees = kStatedWeight;
  for (std::size_t i = first; i < first + kRanges; ++i) degrees += sums_[i].degrees;
  return std::abs(std::log(learned)) > kSigmas * std::sqrt(2.0 / degrees) ? learned : 1.0;
}

double DetectionNoise::factor(LandmarkKind kind, double range_m) const {
  return factors_[bin_of(kind, range_m)];
}

LandmarkScan DetectionNoise::corrected(LandmarkScan scan) const {
  if (!is_misstated()) return scan;
  for (Detection& one : scan.detections) {
    const double factor = this->factor(one.kind, one.position_m.head<2>().norm());
    const Eigen::Vector3d scale(std::sqrt(factor), std::sqrt(factor), 1.0);
    one.covariance_m2 = scale.asDiagonal() * one.covariance_m2 * scale.asDiagonal();
  }
  return scan;
}

LandmarkScan DetectionNoise::rescaled(LandmarkScan scan, double factor) {
  const Eigen::Vector3d scale(std::sqrt(factor), std::sqrt(factor), 1.0);
  for (Detection& one : scan.detections) {
    one.covariance_m2 = scale.asDiagonal() * one.covariance_m2 * scale.asDiagonal();
  }
  return scan;
}

bool DetectionNoise::explains(const LandmarkScan& scan, std::span<const std::uint64_t> tracks,
                              double factor) const {
  if (recent_.empty()) return false;
  const std::vector<Seen> now = seen_in(scan, tracks);
  const std::vector<Pair> pairs = in_both(recent_.back().seen, now);
  if (pairs.size() < kLeastPairs) return false;

  const Fit fit = fitted_motion(pairs);
  double chi2 = 0.0;
  for (const Pair& pair : pairs) chi2 += residual_of(pair, factor, fit.then_T_now).chi2;
  const double degrees = 2.0 * static_cast<double>(pairs.size()) - 3.0;
  return chi2 < kExplained * degrees;
}

std::size_t DetectionNoise::in_common(const LandmarkScan& scan,
                                      std::span<const std::uint64_t> tracks) const {
  return recent_.empty() ? 0 : in_both(recent_.back().seen, seen_in(scan, tracks)).size();
}

std::span<const double> DetectionNoise::tries() const {
  if (!is_new()) return {};
  const std::span<const double> all(kTries);
  return parameters_.replace_below > kTries[1] ? all : all.first(1);
}

bool DetectionNoise::is_new() const {
  double degrees = 0.0;
  for (const Sums& sums : sums_) degrees += sums.degrees;
  return parameters_.learn && degrees < kFewScans;
}

bool DetectionNoise::is_misstated() const {
  return std::ranges::any_of(factors_, [](double factor) { return factor != 1.0; });
}

}  // namespace understory::model
