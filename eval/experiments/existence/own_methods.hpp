// The model of common/existence and its ablations, as methods.
#pragma once

#include <memory>
#include <vector>

#include "eval/experiments/existence/method.hpp"

namespace understory::eval::experiments::existence {

// Parameters of all but the baseline: decay [1/month], what it counts for, share of drives that see
// a point at first.

std::unique_ptr<Method> make_icosahedral(const History& history, const std::vector<double>& tuned);
std::unique_ptr<Method> make_von_mises_fisher(const History& history,
                                              const std::vector<double>& tuned);
/// Patches of 12 m share evidence.
std::unique_ptr<Method> make_neighbours(const History& history, const std::vector<double>& tuned);
/// Implementation 1 of the thesis: lambda = mu = 0.
std::unique_ptr<Method> make_no_decay(const History& history, const std::vector<double>& tuned);
/// Every look is as good as a first: w is not updated, drives are no cause.
std::unique_ptr<Method> make_no_redundancy(const History& history,
                                           const std::vector<double>& tuned);
/// Looks of a drive share no cause but the shell.
std::unique_ptr<Method> make_one_level(const History& history, const std::vector<double>& tuned);
/// p_d = 0.9 and v as they are told.
std::unique_ptr<Method> make_told_recall(const History& history, const std::vector<double>& tuned);
/// The thesis's rules. Parameters: recall, threshold of a face.
std::unique_ptr<Method> make_thesis(const History& history, const std::vector<double>& tuned);

}  // namespace understory::eval::experiments::existence
