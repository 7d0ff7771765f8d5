// What became of the points since each was last surely seen, and the rates that it speaks for.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "common/existence/decay_rate.hpp"

namespace understory::existence {

/// Passes of one point since the last that surely saw it, up to now.
struct OpenHistory {
  double missed_before = 0.0;  ///< Passes before the one that is open that looked and missed it,
  int hidden_before = 0;       ///< others on which returns came from in front of it,
  /// and whether the open one did: 1 - L / L0, the looks' likelihood where it sees the point by
  /// that where it does not; 0: nothing is known, 1: missed. The same whatever v is.
  double missed_now = 0.0;
  /// What the returns in front say of a point that is there and not seen, by what they say of one
  /// that is gone; and from how many sides beams went on behind it.
  double rays = 1.0;
  int passed = 0;
  /// From how many sides the open pass looked; 0 where rays tell what hides the point.
  int sides = 0;
  bool is_seen_now = false;     ///< The open one surely sees it: it never went.
  float since_s = 0.0F;         ///< From the last sure sighting to the begin of the open pass,
  float until_missed_s = 0.0F;  ///< and to the first pass that missed it, where one did.
  DecayEvidence counted{};      ///< What of it DecayRate has counted already.
};

/// v of this drive, v of the drives before, and lambda; 0: nothing learned yet. What hinders a
/// detector (leaves, light, rain) is of one drive: the others say little of its v.
struct LearnedRates {
  double now = 0.0;
  double before = 0.0;
  double before_was = 0.0;  ///< The same until the last call of learn().
  double decay_per_s = 0.0;
  double hidden = 0.0;  ///< Share of what this drive looks at from one side that is hidden.
  /// Beta counts: passes that are over, of points that were seen since.
  double before_seen = 0.0, before_missed = 0.0;

  static constexpr std::size_t kNumbers = 8;
  std::array<double, kNumbers> store() const;
  /// Throws std::invalid_argument where a number cannot be.
  static LearnedRates restored(const std::array<double, kNumbers>& numbers);
};

/// What is known without histories: Beta counts of passes, points that went and their exposure; and
/// how drives differ: v of a drive is Beta around v of those before, worth `alike` passes, but a
/// share `unlike` of the drives may miss anything, as the first one.
struct RatePriors {
  double seen = 0.0, missed = 0.0;
  double went = 0.0, exposure_s = 0.0;
  double alike = 100.0, unlike = 0.05;
  double hidden = 0.4;     ///< Share of drives with something new in the way.
  double passed_by = 1.0;  ///< Share of sides from which beams pass a point that is there.
};

/// What hides a point from one of so many sides hides it from all of them with this probability.
double hides_all(int sides);

/// Capture-recapture with unknown survival (Cormack, Biometrika 51, 1964): a pass sees a point that
/// is there with v, and points go at the rate lambda. That m passes before this drive missed a
/// point, the first of them the time T1 after it was last seen, and that this drive sees it at T,
/// is as likely as
///
///     B = 1 - S1 + S1 (1 - v_before)^m      A v_now,  A = S (1 - v_before)^m / B,
///     S1 = exp(-lambda T1),  S = exp(-lambda T)
///
/// (who goes does so before the first of the misses or after the last). One drive after years fixes
/// the product of its v and S alone, and the priors the rest: steps of EM along such a ridge end
/// somewhere on it. Here the posterior is summed up, so that all of it counts. Passes before differ
/// from each other, which one v for all of them does not say: together they count as one drive at
/// most, and what this drive finds of the points that they missed says the rest.
///
/// Counts are whole numbers: what is taken back leaves nothing, so that counts that are kept while
/// points change are those of a recount, to the bit.
class PassHistories {
 public:
  void add(const OpenHistory& history) { count(history, 1); }
  /// One that was added and has changed since. O(log of the histories that differ).
  void remove(const OpenHistory& history) { count(history, -1); }

  /// Histories that differ.
  std::size_t size() const { return alike_.size(); }
  bool operator==(const PassHistories&) const = default;

  /// `until_now`: with its counts. `went`, `exposure_s`: of all histories, those above as they were
  /// counted, and of the prior. What is not learned stays.
  LearnedRates rates(const LearnedRates& until_now, const RatePriors& priors, double went,
                     double exposure_s, bool learns_recall, bool learns_decay) const;

 private:
  /// Histories that are alike: sums.
  struct Alike {
    std::int64_t points = 0;
    std::int64_t missed_before = 0;  ///< In parts of a pass,
    std::int64_t missed_now = 0;     ///< likewise,
    std::int64_t since = 0;          ///< and of a second,
    std::int64_t until_missed = 0;   ///< likewise;
    std::int64_t rays = 0;           ///< in parts of 1.
    bool operator==(const Alike&) const = default;
  };
  void count(const OpenHistory& history, std::int64_t times);

  /// By misses, the logarithms of the times and of what rays say, sides, and whether this drive
  /// sees the point.
  std::map<std::array<int, 9>, Alike> alike_;
  std::int64_t missed_before_ = 0;  ///< With the hidden ones.
  std::int64_t went_ = 0;           ///< Counted already: to be taken out.
  std::int64_t exposure_ = 0;
};

}  // namespace understory::existence
