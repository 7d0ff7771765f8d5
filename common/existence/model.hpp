// What all points of one map share: parameters, and what was learned about detector and world.
#pragma once

#include <array>
#include <cstdint>

#include "common/existence/decay_rate.hpp"
#include "common/existence/histories.hpp"
#include "common/existence/parameters.hpp"
#include "common/existence/recall.hpp"

namespace understory::existence {

/// What a model has learned, as plain numbers: to be stored with the map.
struct SavedModel {
  static constexpr std::uint64_t kVersion = 2;  ///< 1: without `learned`.
  std::uint64_t version = kVersion;
  std::uint64_t pass = 0;
  std::array<double, DetectorRecall::kNumbers> recall{};
  std::array<double, 2> births{};  ///< Real, false.
  std::array<double, 2> decay{};   ///< Went, exposure [s].
  std::array<double, LearnedRates::kNumbers> learned{};
};

/// Time that passed, for all points that it passed for.
struct Elapsed {
  float dt_s = 0.0F;
  double lost = 0.0;   ///< 1 - exp(-lambda dt).
  float moved = 0.0F;  ///< 1 - exp(-mu dt).
};

/// One per map. A *pass* is a stretch of time in which what hinders the detector at a point stays
/// as it is: a drive, or one way through a place.
class ExistenceModel {
 public:
  /// Throws std::invalid_argument (see check()).
  explicit ExistenceModel(const Parameters& parameters = {});

  const Parameters& parameters() const { return parameters_; }
  const DetectorRecall& recall() const { return recall_; }
  DetectorRecall& recall() { return recall_; }
  const DecayRate& decay() const { return decay_; }
  DecayRate& decay() { return decay_; }

  /// A new pass begins; points notice at their next look.
  void begin_pass() { ++pass_; }
  /// Another drive, after learn(): a pass whose v is its own.
  void begin_drive();
  std::uint32_t pass() const { return pass_; }

  /// The factors of `dt_s` seconds, for PointExistence::elapse(). Throws std::invalid_argument
  /// where it is not finite or below 0.
  Elapsed elapsed(double dt_s) const;

  /// v and lambda anew by what became of all points (PointExistence::tell): the means of their
  /// joint posterior, until the next call. Each point is to reconsider() once then. Without it v
  /// and lambda are what the counts say so far.
  void learn(const PassHistories& histories);
  /// A pass that surely saw a point, and those since the last one that had missed it.
  void record_passes(double seen, double missed);
  /// What learn() has said; `now` is 0 where it was not called yet.
  const LearnedRates& learned() const { return learned_; }

  /// Share of what is looked at from one side only that something hides on this drive; 0 where
  /// learn() was not called.
  double hidden() const { return learned_.hidden; }

  /// P of a point at its first sighting: the share of earlier new points that were real.
  double birth() const { return births_.mean(); }
  /// What a new point seems to be after its first pass: the probability that it is real.
  void record_birth(double is_real) { births_.add(is_real, 1.0 - is_real); }

  float rest_odds() const { return rest_odds_; }  ///< Of the visibility.
  double false_rate() const { return parameters_.false_rate; }

  SavedModel save() const;
  /// Throws std::invalid_argument; the model is then as it was.
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
