#include "common/existence/neighbours.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "common/existence/odds.hpp"

namespace understory::existence {

Patch::Patch(const PatchParameters& parameters) : parameters_(parameters) {
  for (const double share : {parameters.cleared, parameters.gone_in_it, parameters.occluded,
                             parameters.also_from, parameters.cleared + parameters.occluded})
    if (!(share > 0.0 && share < 1.0))
      throw std::invalid_argument("existence: parameters of a patch, allowed: above 0, below 1");
}

PatchMember Patch::join(double odds_before) {
  if (!std::isfinite(odds_before) || odds_before <= 0.0)
    throw std::invalid_argument("existence: odds of a patch's member, allowed: finite, above 0");
  return {.odds_before = odds_before};
}

void Patch::update(PatchMember& member, double odds, std::uint32_t missed_from) {
  if (!std::isfinite(odds) || odds <= 0.0)
    throw std::invalid_argument("existence: odds of a patch's member, allowed: finite, above 0");
  sum_cleared_ -= member.cleared;
  sum_occluded_ -= member.occluded;

  // Likelihoods of the member's looks, over that of "it is gone".
  const double before = probability_of(member.odds_before);
  const double kept = before * (1.0 - parameters_.gone_in_it);
  member.ratio = odds / member.odds_before;
  const double alone = before * member.ratio + 1.0 - before;
  member.cleared = std::log((kept * member.ratio + 1.0 - kept) / alone);
  member.occluded = -std::log(alone);
  sum_cleared_ += member.cleared;
  sum_occluded_ += member.occluded;
  missed_from_ |= missed_from;
}

double Patch::log_occluded() const {
  const int further = std::max(0, std::popcount(missed_from_) - 1);
  return std::log(parameters_.occluded) + further * std::log(parameters_.also_from);
}

double Patch::probability(const PatchMember& member) const {
  // Hypotheses by the others' looks: log of prior times likelihood.
  std::array<double, 3> weights{std::log(1.0 - parameters_.cleared - parameters_.occluded),
                                std::log(parameters_.cleared) + sum_cleared_ - member.cleared,
                                log_occluded() + sum_occluded_ - member.occluded};
  const double most = *std::max_element(weights.begin(), weights.end());
  for (double& weight : weights) weight = std::exp(weight - most);

  const double before = probability_of(member.odds_before);
  const double kept = before * (1.0 - parameters_.gone_in_it);
  const double there =
      (weights[0] * before + weights[1] * kept) * member.ratio + weights[2] * before;
  const double gone =
      weights[0] * (1.0 - before) + weights[1] * (1.0 - kept) + weights[2] * (1.0 - before);
  return there / (there + gone);
}

double Patch::cleared() const {
  const std::array<double, 3> logs{std::log(1.0 - parameters_.cleared - parameters_.occluded),
                                   std::log(parameters_.cleared) + sum_cleared_,
                                   log_occluded() + sum_occluded_};
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double log : logs) sum += std::exp(log - most);
  return std::exp(logs[1] - most) / sum;
}

}  // namespace understory::existence
