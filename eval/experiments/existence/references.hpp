// Methods that are no competitors: nothing is removed, all is known, the rates are known.
#pragma once

#include <memory>
#include <vector>

#include "eval/experiments/existence/method.hpp"

namespace understory::eval::experiments::existence {

/// P = 1 always.
std::unique_ptr<Method> make_no_removal(const History& history, const std::vector<double>& none);
/// P = truth at the last drive begun: the thesis's "ideal" (it does not cull what is hidden).
std::unique_ptr<Method> make_ideal(const History& history, const std::vector<double>& none);
/// Bayes' filter that knows line of sight, recall, the drives' misses, false rate and share of
/// gone: the best that looks allow.
std::unique_ptr<Method> make_true_rates(const History& history, const std::vector<double>& none);

}  // namespace understory::eval::experiments::existence
