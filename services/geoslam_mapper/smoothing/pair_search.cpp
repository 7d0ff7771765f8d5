#include "services/geoslam_mapper/smoothing/pair_search.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "services/geoslam_mapper/smoothing/pass_odds.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// Sigmas within which distances are equal and points coincide.
constexpr double kGate_sigmas = 3.0;
/// Two points at a smaller distance [m] determine no heading.
constexpr double kLeastBaseline_m = 2.0;
constexpr std::size_t kLeastPairs = 2;
/// ln of the least ratio of odds to another pose that shares few of the pairs: one more trunk of a
/// planted row is not enough.
constexpr double kLeastLead = 9.2;

using Points = std::span<const geometry::UncertainPoint>;

/// One place.
struct Place {
  std::vector<geometry::PointPair> pairs;
  geometry::SE2WithCovariance map_T_newest;
  double log_odds = 0.0;
};

class PairSearch {
 public:
  PairSearch(Points ours, Points theirs, double variance_m2, std::span<const double> clutter_per_m2,
             const geometry::SE2WithCovariance& expected)
      : ours_(ours),
        theirs_(theirs),
        variance_m2_(variance_m2),
        clutter_per_m2_(clutter_per_m2),
        expected_(expected),
        prior_(expected.covariance.inverse()) {}

  std::optional<FoundPlace> run() {
    for (std::uint32_t i = 0; i < ours_.size(); ++i)
      for (std::uint32_t k = i + 1; k < ours_.size(); ++k) lay(i, k);
    if (places_.empty()) return std::nullopt;

    const auto best = std::ranges::max_element(places_, {}, &Place::log_odds);
    for (const Place& other : places_) {
      // Two different poses that are both beyond chance: trunks stand in rows, and the odds do not
      // decide.
      const double most = std::min(kLeastLogOdds, best->log_odds - kLeastLead);
      if (!are_alike(*best, other) && other.log_odds > most) return std::nullopt;
    }
    return FoundPlace{best->map_T_newest, best->pairs};
  }

 private:
  double variance(std::uint32_t i, std::uint32_t j) const {
    return ours_[i].variance_m2 + theirs_[j].variance_m2 + variance_m2_;
  }

  /// Aligns two of ours with every two of theirs at the same distance.
  void lay(std::uint32_t i, std::uint32_t k) {
    const Eigen::Vector2d ours_m = ours_[k].position_m - ours_[i].position_m;
    const double length_m = ours_m.norm();
    if (length_m < kLeastBaseline_m) return;
    for (std::uint32_t j = 0; j < theirs_.size(); ++j) {
      for (std::uint32_t l = 0; l < theirs_.size(); ++l) {
        if (l == j) continue;
        const Eigen::Vector2d theirs_m = theirs_[l].position_m - theirs_[j].position_m;
        const double sigma_m = std::sqrt(variance(i, j) + variance(k, l));
        if (std::abs(theirs_m.norm() - length_m) > kGate_sigmas * sigma_m) continue;

        const double turn =
            std::atan2(theirs_m.y(), theirs_m.x()) - std::atan2(ours_m.y(), ours_m.x());
        const Eigen::Vector2d middle_m = 0.5 * (ours_[i].position_m + ours_[k].position_m);
        const geometry::SE2 rotation(0.0, 0.0, turn);
        const Eigen::Vector2d at_m =
            0.5 * (theirs_[j].position_m + theirs_[l].position_m) - rotation * middle_m;
        consider(geometry::SE2(at_m.x(), at_m.y(), turn));
      }
    }
  }

  void consider(const geometry::SE2& map_T_newest) {
    if (!is_expected(map_T_newest)) return;
    Place place{pairs_at(map_T_newest), {map_T_newest, {}}, 0.0};
    if (place.pairs.size() < kLeastPairs) return;
    const bool is_known = std::ranges::any_of(
        places_, [&](const Place& other) { return are_same(place.pairs, other.pairs); });
    if (is_known) return;

    std::vector<PairOfPasses> pairs;
    for (const geometry::PointPair& pair : place.pairs) {
      pairs.push_back({ours_[pair.observed].position_m, theirs_[pair.reference].position_m,
                       variance(pair.observed, pair.reference), clutter_per_m2_[pair.reference]});
    }
    place.map_T_newest = fit_place(pairs, map_T_newest, expected_);
    if (!is_expected(place.map_T_newest.mean)) return;
    place.log_odds = log_odds_of_place(pairs, place.map_T_newest.mean, expected_);
    places_.push_back(std::move(place));
  }

  bool is_expected(const geometry::SE2& map_T_newest) const {
    const Eigen::Vector3d off = (expected_.mean.inverse() * map_T_newest).Log();
    return off.dot(prior_ * off) <= kMostOff;
  }

  /// Pairs each of ours with the nearest free one of theirs.
  std::vector<geometry::PointPair> pairs_at(const geometry::SE2& map_T_newest) const {
    std::vector<geometry::PointPair> pairs;
    for (std::uint32_t i = 0; i < ours_.size(); ++i) {
      const Eigen::Vector2d at_m = map_T_newest * ours_[i].position_m;
      double nearest = kGate_sigmas * kGate_sigmas;
      std::optional<std::uint32_t> found;
      for (std::uint32_t j = 0; j < theirs_.size(); ++j) {
        const double squared = (theirs_[j].position_m - at_m).squaredNorm() / variance(i, j);
        if (squared >= nearest) continue;
        nearest = squared;
        found = j;
      }
      const bool is_free =
          found && std::ranges::none_of(pairs, [&](const geometry::PointPair& pair) {
            return pair.reference == *found;
          });
      if (is_free) pairs.push_back({*found, i, false});
    }
    return pairs;
  }

  static std::size_t common(const std::vector<geometry::PointPair>& a,
                            const std::vector<geometry::PointPair>& b) {
    return static_cast<std::size_t>(std::ranges::count_if(a, [&](const geometry::PointPair& one) {
      return std::ranges::any_of(b, [&](const geometry::PointPair& other) {
        return one.observed == other.observed && one.reference == other.reference;
      });
    }));
  }
  static bool are_same(const std::vector<geometry::PointPair>& a,
                       const std::vector<geometry::PointPair>& b) {
    return a.size() == b.size() && common(a, b) == a.size();
  }
  static bool are_alike(const Place& a, const Place& b) {
    return 2 * common(a.pairs, b.pairs) >= std::min(a.pairs.size(), b.pairs.size());
  }

  Points ours_, theirs_;
  double variance_m2_;
  std::span<const double> clutter_per_m2_;
  geometry::SE2WithCovariance expected_;
  Eigen::Matrix3d prior_;
  std::vector<Place> places_;
};

}  // namespace

std::optional<FoundPlace> search_pairs(std::span<const geometry::UncertainPoint> ours,
                                       std::span<const geometry::UncertainPoint> theirs,
                                       double variance_m2, std::span<const double> clutter_per_m2,
                                       const geometry::SE2WithCovariance& expected) {
  return PairSearch(ours, theirs, variance_m2, clutter_per_m2, expected).run();
}

}  // namespace understory::geoslam_mapper::smoothing
