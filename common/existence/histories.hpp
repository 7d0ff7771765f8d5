// Histories of the points since each was last surely seen, and the rates estimated from them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "common/existence/decay_rate.hpp"

namespace understory::existence {

/// Passes of one point since the last sure sighting, up to now.
struct OpenHistory {
  double missed_before = 0.0;  ///< Closed passes that looked and missed the point.
  int hidden_before = 0;       ///< Closed passes with returns in front of the point.
  /// Miss of the open pass: 1 - L / L0, with the likelihood L of the looks if the pass can see the
  /// point and L0 if it cannot; 0: no evidence, 1: missed. Independent of v.
  double missed_now = 0.0;
  /// Likelihood ratio of the returns in front, for an existing unseen point against a removed one;
  /// `passed`: number of sides from which beams passed behind the point.
  double rays = 1.0;
  int passed = 0;
  /// Number of sides from which the open pass looked; 0 where ranges show the occlusion.
  int sides = 0;
  bool is_seen_now = false;     ///< The open pass surely sees the point: it was not removed.
  float since_s = 0.0F;         ///< Time from the last sure sighting to the begin of the open pass.
  float until_missed_s = 0.0F;  ///< Time from it to the first pass that missed the point, if any.
  DecayEvidence counted{};      ///< Contribution already counted in DecayRate.
};

/// v of this drive, v of the drives before, and lambda; 0: nothing learned yet. Causes of misses
/// (leaves, light, rain) belong to one drive: other drives contain little information on its v.
struct LearnedRates {
  double now = 0.0;
  double before = 0.0;
  double before_was = 0.0;  ///< `before` until the last call of learn().
  double decay_per_s = 0.0;
  double hidden = 0.0;  ///< Hidden share of the points that this drive observes from one side.
  /// Beta counts of closed passes, from points that were seen later.
  double before_seen = 0.0, before_missed = 0.0;

  static constexpr std::size_t kNumbers = 8;
  std::array<double, kNumbers> store() const;
  /// Throws std::invalid_argument where a number is impossible.
  static LearnedRates restored(const std::array<double, kNumbers>& numbers);
};

/// Priors without histories: Beta counts of passes, removed points and their exposure, and the
/// differences between drives. v of a drive has a Beta prior around v of the drives before, with
/// the weight of `alike` passes; for a share `unlike` of the drives, and for the first one, v is
/// arbitrary.
struct RatePriors {
  double seen = 0.0, missed = 0.0;
  double went = 0.0, exposure_s = 0.0;
  double alike = 100.0, unlike = 0.05;
  double hidden = 0.4;     ///< Share of drives with a new obstacle.
  double passed_by = 1.0;  ///< Share of sides from which beams pass a point that is there.
};

/// Probability that an obstacle that hides a point from one of `sides` sides hides it from all of
/// them.
double hides_all(int sides);

/// Capture-recapture with unknown survival (Cormack, Biometrika 51, 1964): a pass sees an existing
/// point with probability v, and points are removed at the rate lambda. If m passes before this
/// drive missed a point, the first of them at the time T1 after the last sighting, this drive sees
/// it at T with the likelihood
///
///     B = 1 - S1 + S1 (1 - v_before)^m      A v_now,  A = S (1 - v_before)^m / B,
///     S1 = exp(-lambda T1),  S = exp(-lambda T)
///
/// (a point is removed either before the first miss or after the last one). One drive after years
/// determines only the product of its v and S, the priors determine the rest: EM would stop
/// anywhere on this ridge. Therefore the posterior is integrated numerically. Earlier passes differ
/// from each other, but the model has one v for all of them: together they count as one drive at
/// most; the remaining evidence is the points that they missed and this drive sees.
///
/// Counts are integers, so removing a history is exact: updated counts equal those of a recount, to
/// the bit.
class PassHistories {
 public:
  void add(const OpenHistory& history) { count(history, 1); }
  /// Removes a history that was added. O(log of the number of different histories).
  void remove(const OpenHistory& history) { count(history, -1); }

  /// Number of different histories.
  std::size_t size() const { return alike_.size(); }
  bool operator==(const PassHistories&) const = default;

  /// The posterior means. `until_now`: present rates with their counts. `went`, `exposure_s`: sums
  /// over all histories as counted in DecayRate, and the prior. Rates that are not learned stay.
  LearnedRates rates(const LearnedRates& until_now, const RatePriors& priors, double went,
                     double exposure_s, bool learns_recall, bool learns_decay) const;

 private:
  /// Sums over similar histories.
  struct Alike {
    std::int64_t points = 0;
    std::int64_t missed_before = 0;  ///< In parts of a pass.
    std::int64_t missed_now = 0;     ///< In parts of a pass.
    std::int64_t since = 0;          ///< In parts of a second.
    std::int64_t until_missed = 0;   ///< In parts of a second.
    std::int64_t rays = 0;           ///< In parts of 1.
    bool operator==(const Alike&) const = default;
  };
  void count(const OpenHistory& history, std::int64_t times);

  /// Key: misses, logarithms of the times and of `rays`, sides, and whether this drive sees the
  /// point.
  std::map<std::array<int, 9>, Alike> alike_;
  std::int64_t missed_before_ = 0;  ///< Hidden ones included.
  std::int64_t went_ = 0;           ///< Already counted in DecayRate: to be subtracted.
  std::int64_t exposure_ = 0;
};

}  // namespace understory::existence
