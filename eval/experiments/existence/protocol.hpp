// Methods on histories: tuned on training histories, scored on others.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "eval/experiments/existence/method.hpp"
#include "eval/experiments/existence/scores.hpp"

namespace understory::eval::experiments::existence {

/// A method with its parameters.
struct TunedMethod {
  std::string name;
  MakeMethod make = nullptr;
  std::vector<double> tuned;
};

/// Points of the map: seen five times and more in a mapping drive, and in a tenth of its looks.
std::vector<bool> mapped_points(const History& history);

/// What a method says after each changed drive.
struct AfterDrive {
  std::vector<ScoredPoint> scored;  ///< In unobstructed view 10 times from 3 directions, so far.
  std::vector<ScoredPoint> rest;
  std::vector<ScoredPoint> hidden;  ///< There, and without a clear line of sight in this drive.
};
/// In the order of the changed drives.
std::vector<AfterDrive> run_method(const TunedMethod& method, const History& history);

/// The best of the kind's grid on the training histories: largest mean of ROC area minus Brier
/// score.
TunedMethod tune(const MethodKind& kind, const std::vector<History>& training);

/// References, peers and our own, each with its grid; Perpetua's mixtures by EM on the training.
std::vector<MethodKind> method_kinds(const std::vector<History>& training);

}  // namespace understory::eval::experiments::existence
