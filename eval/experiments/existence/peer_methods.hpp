// The peers as methods.
#pragma once

#include <memory>
#include <vector>

#include "eval/experiments/existence/method.hpp"
#include "eval/experiments/existence/peers/perpetua.hpp"

namespace understory::eval::experiments::existence {

/// Parameters: recall, false rate, bound of the log-odds.
std::unique_ptr<Method> make_counter(const History& history, const std::vector<double>& tuned);
/// Parameters: recall, false rate, rate [1/month].
std::unique_ptr<Method> make_persistence(const History& history, const std::vector<double>& tuned);
/// The same, and the coupling.
std::unique_ptr<Method> make_joint(const History& history, const std::vector<double>& tuned);
/// Parameters: recall, false rate; then rates [1/month] and weights of persistence (two each), rate
/// of emergence.
std::unique_ptr<Method> make_perpetua(const History& history, const std::vector<double>& tuned);

/// Perpetua's parameters for a recall and a false rate: mixture by EM over training histories.
std::vector<double> perpetua_by_em(const std::vector<History>& training, double recall,
                                   double false_rate);

}  // namespace understory::eval::experiments::existence
