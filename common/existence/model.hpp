// Common to all points of one map: parameters, and learned values of detector and world.
#pragma once

#include <array>
#include <cstdint>

#include "common/existence/decay_rate.hpp"
#include "common/existence/histories.hpp"
#include "common/existence/parameters.hpp"
#include "common/existence/recall.hpp"

namespace understory::existence {

/// Learned values of a model as plain numbers, stored with the map.
struct SavedModel {
  static constexpr std::uint64_t kVersion = 2;  ///< 1: without `learned`.
  std::uint64_t version = kVersion;
  std::uint64_t pass = 0;
  std::array<double, DetectorRecall::kNumbers> recall{};
  std::array<double, 2> births{};  ///< Counts of real and of false points.
  std::array<double, 2> decay{};   ///< Removed points, exposure [s].
  std::array<double, LearnedRates::kNumbers> learned{};
};

/// Elapsed time and its factors, for all points.
struct Elapsed {
  float dt_s = 0.0F;
  double lost = 0.0;   ///< 1 - exp(-lambda dt).
  float moved = 0.0F;  ///< 1 - exp(-mu dt).
};

/// One per map. A *pass* is a time interval in which the causes of misses at a point stay constant:
/// a drive, or one way through a place.
class ExistenceModel {
 public:
  /// Throws std::invalid_argument (see check()).
  explicit ExistenceModel(const Parameters& parameters = {});

  const Parameters& parameters() const { return parameters_; }
  const DetectorRecall& recall() const { return recall_; }
  DetectorRecall& recall() { return recall_; }
  const DecayRate& decay() const { return decay_; }
  DecayRate& decay() { return decay_; }

  /// Begins a new pass; points follow at their next look.
  void begin_pass() { ++pass_; }
  /// Begins another drive, after learn(): a pass with its own v.
  void begin_drive();
  std::uint32_t pass() const { return pass_; }

  /// The factors of `dt_s` seconds, for PointExistence::elapse(). Throws std::invalid_argument
  /// where it is not finite or below 0.
  Elapsed elapsed(double dt_s) const;

  /// Computes v and lambda from the histories of all points (PointExistence::tell): the means of
  /// their joint posterior, valid until the next call. Call reconsider() once for each point
  /// afterwards. Without learn(), v and lambda follow from the counts.
  void learn(const PassHistories& histories);
  /// Counts passes: `seen` surely saw a point, `missed` missed it since the last sure sighting.
  void record_passes(double seen, double missed);
  /// Result of learn(); `now` is 0 before its first call.
  const LearnedRates& learned() const { return learned_; }

  /// Hidden share of the points observed from one side only on this drive; 0 before learn().
  double hidden() const { return learned_.hidden; }

  /// P of a point at its first sighting: the share of earlier new points that were real.
  double birth() const { return births_.mean(); }
  /// Counts a new point after its first pass, with its probability to be real.
  void record_birth(double is_real) { births_.add(is_real, 1.0 - is_real); }

  float rest_odds() const { return rest_odds_; }  ///< Odds of the start visibility.
  double false_rate() const { return parameters_.false_rate; }

  SavedModel save() const;
  /// Throws std::invalid_argument; the model is then unchanged.
  void load(const SavedModel& saved);

 private:
  void hold();

  Parameters parameters_;
  DetectorRecall recall_;
  DecayRate decay_;
  BetaCounts births_;
  LearnedRates learned_;
  float rest_odds_;
  std::uint32_t pass_ = 1;
};

}  // namespace understory::existence
