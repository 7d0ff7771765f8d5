#include "common/map_merge/alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "common/constellation/map.hpp"
#include "common/geometry/decompositions.hpp"
#include "common/geometry/registration.hpp"
#include "common/map_merge/fit.hpp"
#include "common/map_merge/landmark_set.hpp"
#include "common/map_merge/pairing.hpp"
#include "common/map_merge/windows.hpp"

namespace understory::map_merge {
namespace {

/// Per axis [m]; see WindowSize.
constexpr double kLocalSigma_m = 0.15;
constexpr double kAnySigma_m = 1e9;
/// Tried one after the other: with few common landmarks or much noise, small windows are not found.
constexpr std::array<WindowSize, 6> kWindows{{{30, kLocalSigma_m},
                                              {60, kLocalSigma_m},
                                              {150, kLocalSigma_m},
                                              {60, kAnySigma_m},
                                              {150, kAnySigma_m},
                                              {400, kAnySigma_m}}};
constexpr int kMostRounds = 10;
/// A guess allows motions within this many standard deviations; motions that differ by this [m],
/// [rad] are distinct.
constexpr double kGuessSigmas = 4.0;
constexpr std::size_t kGuessPairs = 5;
constexpr double kGuessDecades = 4.0;
constexpr double kToldApart_m = 0.1;
constexpr double kToldApart_rad = 0.01;
/// Neighbours of a landmark to which the best motion is shifted, itself included.
constexpr std::size_t kNeighboursBeside = 13;

/// A motion with its evidence.
struct Verified {
  MotionFit fit;
  Pairing pairing;
};

std::vector<geometry::UncertainPoint> points_of(const LandmarkSet& set) {
  std::vector<geometry::UncertainPoint> points;
  points.reserve(set.all().size());
  for (const UncertainLandmark& one : set.all())
    points.push_back({one.position_m, std::min(one.variance_m2(), kLocalSigma_m * kLocalSigma_m)});
  return points;
}

bool has_same_pairs(const Pairing& a, const Pairing& b) {
  return std::ranges::equal(a.pairs, b.pairs, [](const LandmarkPair& x, const LandmarkPair& y) {
    return x.first == y.first && x.second == y.second;
  });
}

class AlignmentSearch {
 public:
  AlignmentSearch(const LandmarkSet& first, const LandmarkSet& second,
                  const AlignmentParameters& parameters,
                  const std::function<void(double)>& progress)
      : first_(first),
        second_(second),
        parameters_(parameters),
        progress_(progress),
        first_points_(points_of(first)),
        second_points_(points_of(second)) {
    const LandmarkSet& larger = searches_second() ? first_ : second_;
    for (std::uint32_t i = 0; i < larger.all().size(); ++i)
      map_.insert(i + 1, larger.all()[i].position_m);
  }

  /// Only motions allowed by a guess are tried, and the bound on chance counts only these.
  void take(const geometry::SE2WithCovariance& guess) {
    guess_ = guess;
    allowed_ = std::max(1.0, std::pow(2.0 * kGuessSigmas, 3) *
                                 std::sqrt(std::max(0.0, guess.covariance.determinant())) /
                                 (kToldApart_m * kToldApart_m * kToldApart_rad));
    if (auto verified = verify(guess)) consider(std::move(*verified));
  }

  Alignment run() {
    if (std::min(first_.all().size(), second_.all().size()) < parameters_.min_pairs)
      return result(AlignmentOutcome::kTooFewLandmarks);

    WindowSize last;
    for (std::size_t i = 0; i < kWindows.size(); ++i) {
      if (finds_the_same(last, kWindows[i])) continue;
      last = kWindows[i];
      take_windows(last, [&](double part) {
        progress_((static_cast<double>(i) + part) / static_cast<double>(kWindows.size()));
      });
      if (outcome() == AlignmentOutcome::kAligned) break;
    }
    if (outcome() == AlignmentOutcome::kAligned) look_beside();
    return result(outcome());
  }

 private:
  bool searches_second() const { return first_.all().size() >= second_.all().size(); }

  const LandmarkSet& smaller() const { return searches_second() ? second_ : first_; }

  /// Whether windows of this size equal those searched last.
  bool finds_the_same(const WindowSize& last, const WindowSize& size) const {
    const bool has_all = last.landmarks >= std::min(size.landmarks, smaller().all().size());
    const bool is_as_sure = std::ranges::all_of(smaller().all(), [&](const auto& one) {
      return one.variance_m2() <= last.most_sigma_m * last.most_sigma_m;
    });
    return has_all && (is_as_sure || last.most_sigma_m >= size.most_sigma_m);
  }

  void take_windows(const WindowSize& size, const std::function<void(double)>& progress) {
    const WindowSearch search = search_windows(map_, smaller(), size, progress);
    windows_ += search.windows;
    hypotheses_ += search.tried;
    for (const Hypothesis& one : search.hypotheses) {
      const auto& map_T_searched = one.map_T_searched;
      auto verified =
          verify(searches_second() ? map_T_searched : geometry::inverse(map_T_searched));
      if (verified) consider(std::move(*verified));
    }
  }

  /// Verifies a window's motion on all landmarks of the overlap.
  std::optional<Verified> verify(const geometry::SE2WithCovariance& guess) const {
    geometry::RegistrationParameters registration;
    registration.gate_sigmas = parameters_.gate_sigmas;
    registration.gate_floor_m = parameters_.gate_floor_m;
    const auto registered =
        geometry::register_points(first_points_, second_points_, guess, registration);

    Verified one;
    one.fit.model.first_T_second = registered.reference_T_observed;
    for (int round = 0; round < kMostRounds; ++round) {
      // The residual may be below the stated covariances where errors are common; the pairing uses
      // a lower limit.
      DifferenceModel model = one.fit.model;
      model.scale = std::max(1.0, model.scale);
      Pairing pairing = pair_up(first_, second_, model, parameters_);
      const bool is_settled = has_same_pairs(pairing, one.pairing);
      one.pairing = std::move(pairing);
      if (one.pairing.pairs.size() < 3) return std::nullopt;
      if (is_settled) break;
      one.fit = fit_motion(first_, second_, one.pairing.pairs, model.first_T_second);
    }
    return one;
  }

  /// Rows of an orchard fit again when shifted by one tree: tries the best motion shifted so that a
  /// central landmark coincides with one of its neighbours, or rotated about it.
  void look_beside() {
    const DifferenceModel& model = best_->fit.model;
    const auto farther = [&](const LandmarkPair& pair) {
      return (second_.all()[pair.second].position_m - model.centre_m).squaredNorm();
    };
    const LandmarkPair middle = *std::ranges::min_element(best_->pairing.pairs, {}, farther);
    const Eigen::Vector2d& at = first_.all()[middle.first].position_m;
    const Eigen::Vector2d& from = second_.all()[middle.second].position_m;

    for (const std::uint32_t neighbour : first_.nearest(at, kNeighboursBeside)) {
      const Eigen::Vector2d& to = first_.all()[neighbour].position_m;
      for (int quarter = 0; quarter < 4; ++quarter) {
        if (neighbour == middle.first && quarter == 0) continue;
        const double heading = model.first_T_second.theta() + quarter * std::numbers::pi / 2.0;
        const geometry::SE2 turn(0.0, 0.0, heading);
        consider_beside(geometry::SE2(Eigen::Vector2d(to - turn * from), heading));
      }
    }
  }

  bool is_allowed(const geometry::SE2& first_T_second) const {
    if (!guess_) return true;
    const Eigen::Vector3d off = (guess_->mean.inverse() * first_T_second).Log();
    return off.dot(geometry::symmetric_inverse(guess_->covariance) * off) <=
           kGuessSigmas * kGuessSigmas;
  }

  void consider_beside(const geometry::SE2& first_T_second) {
    if (!is_allowed(first_T_second)) return;
    Verified one;
    one.fit.model = best_->fit.model;
    one.fit.model.first_T_second = first_T_second;
    one.fit.model.scale = std::max(1.0, one.fit.model.scale);
    one.pairing = pair_up(first_, second_, one.fit.model, parameters_);
    if (!is_same(*best_, one)) keep_runner_up(one.pairing.log10_tail);
  }

  static bool is_same(const Verified& a, const Verified& b) {
    std::size_t common = 0;
    for (const LandmarkPair& pair : a.pairing.pairs) {
      const auto found =
          std::ranges::lower_bound(b.pairing.pairs, pair.second, {}, &LandmarkPair::second);
      if (found != b.pairing.pairs.end() && found->second == pair.second &&
          found->first == pair.first)
        ++common;
    }
    return 2 * common > std::min(a.pairing.pairs.size(), b.pairing.pairs.size());
  }

  void consider(Verified one) {
    if (!is_allowed(one.fit.model.first_T_second)) return;
    if (best_ && is_same(*best_, one)) {
      if (one.pairing.log10_tail < best_->pairing.log10_tail) best_ = std::move(one);
      return;
    }
    if (!best_ || one.pairing.log10_tail < best_->pairing.log10_tail) {
      if (best_) keep_runner_up(best_->pairing.log10_tail);
      best_ = std::move(one);
    } else {
      keep_runner_up(one.pairing.log10_tail);
    }
  }
  void keep_runner_up(double log10_tail) { runner_up_ = std::min(runner_up_, log10_tail); }

  double false_alarm() const {
    const double tried = static_cast<double>(std::max<std::size_t>(hypotheses_, 1));
    return best_->pairing.log10_tail + std::log10(std::min(tried, allowed_));
  }
  double margin() const { return runner_up_ - best_->pairing.log10_tail; }
  double least_margin() const {
    return std::max(parameters_.min_log10_margin,
                    -parameters_.min_margin_share * best_->pairing.log10_tail);
  }

  AlignmentOutcome outcome() const {
    if (!best_ || best_->pairing.pairs.size() < parameters_.min_pairs)
      return AlignmentOutcome::kNoOverlap;
    if (false_alarm() > parameters_.max_log10_false_alarm) return AlignmentOutcome::kLikelyChance;
    if (best_->pairing.share() < parameters_.min_share) return AlignmentOutcome::kFewInCommon;
    if (margin() < least_margin()) return AlignmentOutcome::kAmbiguous;
    return AlignmentOutcome::kAligned;
  }

  Alignment result(AlignmentOutcome outcome) const {
    Alignment alignment;
    alignment.outcome = outcome;
    alignment.windows = windows_;
    alignment.hypotheses = hypotheses_;
    if (!best_) return alignment;

    const DifferenceModel& model = best_->fit.model;
    alignment.first_T_second = model.first_T_second;
    alignment.covariance = best_->fit.covariance;
    alignment.first_in_overlap = best_->pairing.first_in_overlap;
    alignment.second_in_overlap = best_->pairing.second_in_overlap;
    alignment.pairs_in_overlap = best_->pairing.pairs_in_overlap;
    alignment.log10_false_alarm = false_alarm();
    alignment.log10_margin = margin();
    alignment.pairs = best_->pairing.pairs;
    for (LandmarkPair& pair : alignment.pairs) {
      const UncertainLandmark& a = first_.all()[pair.first];
      const UncertainLandmark& b = second_.all()[pair.second];
      const double stated_m2 = model.stated(a, b).trace();
      pair.independent_share =
          stated_m2 > 0.0 ? std::min(1.0, model.independent(a, b).trace() / stated_m2) : 1.0;
      pair.first = first_.all()[pair.first].index;
      pair.second = second_.all()[pair.second].index;
    }
    return alignment;
  }

  const LandmarkSet& first_;
  const LandmarkSet& second_;
  const AlignmentParameters& parameters_;
  const std::function<void(double)>& progress_;
  std::vector<geometry::UncertainPoint> first_points_;
  std::vector<geometry::UncertainPoint> second_points_;
  constellation::ConstellationMap map_;  ///< The larger map; ids are indices in all(), plus 1.
  std::optional<geometry::SE2WithCovariance> guess_;  ///< Guess, if given.
  /// Number of distinct motions allowed by the guess.
  double allowed_ = std::numeric_limits<double>::infinity();
  std::optional<Verified> best_;
  double runner_up_ = 0.0;  ///< log10_tail of the best different motion.
  std::size_t windows_ = 0;
  std::size_t hypotheses_ = 0;
};

}  // namespace

std::string_view describe(AlignmentOutcome outcome) {
  switch (outcome) {
    case AlignmentOutcome::kAligned:
      return "they overlap";
    case AlignmentOutcome::kTooFewLandmarks:
      return "too few landmarks";
    case AlignmentOutcome::kNoOverlap:
      return "no overlap was found";
    case AlignmentOutcome::kLikelyChance:
      return "not sure: chance gives as many pairs";
    case AlignmentOutcome::kFewInCommon:
      return "not sure: too few landmarks are in both maps";
    case AlignmentOutcome::kAmbiguous:
      return "not sure: another place fits nearly as well";
  }
  return "";
}

double Alignment::share() const {
  const std::size_t possible = std::min(first_in_overlap, second_in_overlap);
  if (possible == 0) return 0.0;
  return std::min(1.0, static_cast<double>(pairs_in_overlap) / static_cast<double>(possible));
}

std::string Alignment::reason(const AlignmentParameters& parameters) const {
  if (outcome == AlignmentOutcome::kTooFewLandmarks)
    return fmt::format("{} (at least {} each)", describe(outcome), parameters.min_pairs);
  return fmt::format(
      "{} ({} pairs, at least {}; {:.0f} % of the landmarks there, at least {:.0f} %; by chance "
      "10^{:.0f}, at most 10^{:.0f}; another place 10^{:.0f}; {} windows)",
      describe(outcome), pairs.size(), parameters.min_pairs, 100.0 * share(),
      100.0 * parameters.min_share, log10_false_alarm, parameters.max_log10_false_alarm,
      log10_false_alarm + log10_margin, windows);
}

Alignment align(std::span<const model::MapLandmark> first,
                std::span<const model::MapLandmark> second, const AlignmentParameters& parameters,
                const std::function<void(double)>& progress) {
  const LandmarkSet first_set(first, parameters.unknown_sigma_m);
  const LandmarkSet second_set(second, parameters.unknown_sigma_m);
  return AlignmentSearch(first_set, second_set, parameters, progress).run();
}

AlignmentParameters with_guess(AlignmentParameters parameters) {
  parameters.min_pairs = std::min(parameters.min_pairs, kGuessPairs);
  parameters.max_log10_false_alarm = std::max(parameters.max_log10_false_alarm, -kGuessDecades);
  parameters.min_log10_margin = std::min(parameters.min_log10_margin, kGuessDecades);
  return parameters;
}

Alignment align_near(const geometry::SE2WithCovariance& guess,
                     std::span<const model::MapLandmark> first,
                     std::span<const model::MapLandmark> second,
                     const AlignmentParameters& parameters) {
  const LandmarkSet first_set(first, parameters.unknown_sigma_m);
  const LandmarkSet second_set(second, parameters.unknown_sigma_m);
  const std::function<void(double)> nothing = [](double /*part*/) {};
  const AlignmentParameters eased = with_guess(parameters);
  AlignmentSearch search(first_set, second_set, eased, nothing);
  search.take(guess);
  return search.run();
}

}  // namespace understory::map_merge
