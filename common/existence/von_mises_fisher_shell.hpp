// A continuous shell: a fixed number of von Mises-Fisher lobes on the sphere (thesis 003,
// Contribution).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "common/existence/odds.hpp"
#include "common/existence/shell.hpp"

namespace understory::existence {

/// K lobes, each with mean direction and concentration (both from the sum of the directions of its
/// looks), log-odds of the visibility and reach. Between lobes both functions are their mean,
/// weighted by the lobes' densities; far from all lobes they have their start values.
template <std::size_t K>
requires(K > 0 && K < 24) class VonMisesFisherShell {
 public:
  /// Shares of a direction in each lobe; `nearest` of them.
  struct Place {
    std::array<float, K> shares{};
    float squares = 0.0F;  ///< Sum of squared shares.
    std::size_t nearest = 0;
    Eigen::Vector3f direction;
    bool is_new = false;  ///< No lobe is near: the next multiply() begins one.
  };
  static constexpr std::size_t kNumbers = 7 * K + 3;
  static constexpr std::uint32_t kKind = 0x100 + K;

  VonMisesFisherShell(float visibility_odds, float reach_m)
      : rest_log_odds_(std::log(visibility_odds)), rest_reach_m_(reach_m) {}

  Place locate(const Eigen::Vector3f& direction) const {
    Place place;
    place.direction = direction;
    float sum = kFarShare;
    float most = 0.0F;
    for (std::size_t k = 0; k < used(); ++k) {
      const Lobe& lobe = lobes_[k];
      place.shares[k] = density(lobe, direction);
      sum += place.shares[k];
      if (place.shares[k] <= most) continue;
      most = place.shares[k];
      place.nearest = k;
    }
    place.is_new = most < kNearDensity && used() < K;
    for (std::size_t k = 0; k < used(); ++k) {
      place.shares[k] /= sum;
      place.squares += place.shares[k] * place.shares[k];
    }
    return place;
  }

  float visibility_odds(const Place& place) const {
    float log_odds = rest_log_odds_;
    for (std::size_t k = 0; k < used(); ++k)
      log_odds += place.shares[k] * (lobes_[k].log_odds - rest_log_odds_);
    return std::exp(log_odds);
  }
  float reach_m(const Place& place) const {
    float reach = rest_reach_m_;
    for (std::size_t k = 0; k < used(); ++k)
      reach += place.shares[k] * (lobes_[k].reach_m - rest_reach_m_);
    return reach;
  }
  int sector(const Place& place) const {
    return static_cast<int>(place.is_new ? used() : place.nearest);
  }

  /// Changes the lobes by least squares so that the place itself gets the ratio; the nearest lobe
  /// includes the direction in its mean.
  void multiply(Place& place, float ratio, float most_odds) {
    if (place.is_new) place = begin_lobe(place.direction);
    Lobe& nearest = lobes_[place.nearest];
    const float weight = nearest.sum.norm() < kMostLooks ? 1.0F : 0.0F;
    nearest.sum += weight * place.direction;
    nearest.looks += weight;

    const float most = std::log(most_odds);
    const float step = std::log(ratio) / std::max(place.squares, kLeastSquares);
    for (std::size_t k = 0; k < used(); ++k)
      lobes_[k].log_odds =
          std::clamp(lobes_[k].log_odds + step * place.shares[k], kLeastLogOdds, most);
  }
  void extend(const Place& place, float distance_m) {
    const float missing_m = distance_m - reach_m(place);
    if (!(missing_m > 0.0F) || place.squares <= 0.0F) return;
    for (std::size_t k = 0; k < used(); ++k)
      lobes_[k].reach_m += missing_m * place.shares[k] / place.squares;
  }

  void relax(float rest, float share) {
    for (std::size_t k = 0; k < used(); ++k) {
      lobes_[k].log_odds = relaxed_log(lobes_[k].log_odds, rest, share);
      lobes_[k].before = relaxed_log(lobes_[k].before, rest, share);
    }
  }
  void begin_pass() {
    for (Lobe& lobe : lobes_) lobe.before = lobe.log_odds;
  }
  void end_pass(float share) {
    for (std::size_t k = 0; k < used(); ++k) {
      const double now = probability_of(std::exp(static_cast<double>(lobes_[k].log_odds)));
      const double then = probability_of(std::exp(static_cast<double>(lobes_[k].before)));
      lobes_[k].log_odds = static_cast<float>(std::log(odds_of(then + (now - then) * share)));
    }
  }

  void store(std::span<float> numbers) const {
    auto out = numbers.begin();
    *out++ = rest_log_odds_;
    *out++ = rest_reach_m_;
    *out++ = static_cast<float>(used_);
    for (const Lobe& lobe : lobes_)
      for (const float number : {lobe.sum.x(), lobe.sum.y(), lobe.sum.z(), lobe.looks,
                                 lobe.log_odds, lobe.before, lobe.reach_m})
        *out++ = number;
  }
  bool restore(std::span<const float> numbers) {
    const auto is_finite = [](float number) { return std::isfinite(number); };
    if (numbers.size() != kNumbers || !std::all_of(numbers.begin(), numbers.end(), is_finite))
      return false;
    if (numbers[1] <= 0.0F || numbers[2] < 0.0F || numbers[2] > static_cast<float>(K)) return false;
    rest_log_odds_ = numbers[0];
    rest_reach_m_ = numbers[1];
    used_ = static_cast<std::uint32_t>(numbers[2]);
    for (std::size_t k = 0; k < K; ++k) {
      const std::span<const float> from = numbers.subspan(3 + 7 * k, 7);
      lobes_[k] = {{from[0], from[1], from[2]}, from[3], from[4], from[5], from[6]};
    }
    return true;
  }

  std::size_t lobes() const { return used_; }  ///< Number of lobes in use.

 private:
  struct Lobe {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();  ///< Sum of the directions, each of length 1.
    float looks = 0.0F;                             ///< Number of directions.
    float log_odds = 0.0F;
    float before = 0.0F;  ///< log_odds at the begin of the pass.
    float reach_m = 0.0F;
  };
  static constexpr float kFarShare =
      0.05F;  ///< Density of "no lobe"; a lobe's own is 1 at its mean.
  static constexpr float kNearDensity = 0.25F;  ///< Below it a direction starts a new lobe.
  /// Lower limit of `squares`: far from all lobes they learn less.
  static constexpr float kLeastSquares = 0.04F;
  static constexpr float kMostLooks = 1e4F;  ///< Limit of the looks in the mean.
  static constexpr float kLeastLogOdds = -39.0F;

  std::size_t used() const { return used_; }

  /// exp(kappa (u m - 1)). The concentration matches the spread of the lobe's directions (Banerjee
  /// et al. 2005), between 4 (40 degrees) and 20 (18 degrees).
  static float density(const Lobe& lobe, const Eigen::Vector3f& direction) {
    const float length = lobe.sum.norm();
    const float mean = std::min(length / lobe.looks, 0.999F);
    const float kappa = std::clamp(mean * (3.0F - mean * mean) / (1.0F - mean * mean), 4.0F, 20.0F);
    return std::exp(kappa * (lobe.sum.dot(direction) / length - 1.0F));
  }
  static float relaxed_log(float log_odds, float rest, float share) {
    return static_cast<float>(
        std::log(relaxed(std::exp(static_cast<double>(log_odds)), rest, share)));
  }

  Place begin_lobe(const Eigen::Vector3f& direction) {
    const Place seen = locate(direction);
    Lobe& lobe = lobes_[used_];
    lobe.log_odds = std::log(visibility_odds(seen));
    lobe.before = lobe.log_odds;
    lobe.reach_m = reach_m(seen);
    lobe.sum = direction;
    lobe.looks = 1.0F;
    ++used_;
    return locate(direction);
  }

  std::array<Lobe, K> lobes_{};
  float rest_log_odds_;
  float rest_reach_m_;
  std::uint32_t used_ = 0;
};
static_assert(Shell<VonMisesFisherShell<6>>);

}  // namespace understory::existence
