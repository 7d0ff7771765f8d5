#include "common/existence/neighbours.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "common/existence/odds.hpp"

namespace understory::existence {
namespace {

void check_odds(double odds) {
  if (!std::isfinite(odds) || odds <= 0.0)
    throw std::invalid_argument("existence: odds of a patch's member, allowed: finite, above 0");
}

std::array<double, 3> normalised(std::array<double, 3> logs) {
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (double& log : logs) sum += log = std::exp(log - most);
  for (double& weight : logs) weight /= sum;
  return logs;
}

}  // namespace

Patch::Patch(const PatchParameters& parameters) : parameters_(parameters) {
  for (const double share : {parameters.cleared, parameters.gone_in_it, parameters.occluded,
                             parameters.also_from, parameters.cleared + parameters.occluded})
    if (!(share > 0.0 && share < 1.0))
      throw std::invalid_argument("existence: parameters of a patch, allowed: above 0, below 1");
}

PatchMember Patch::join(double odds_before) const {
  check_odds(odds_before);
  PatchMember member;
  member.before = probability_of(odds_before);
  // P before the looks already includes the clearing: before = (1 - cleared) alone + cleared kept.
  member.alone =
      std::min(1.0 - 1e-6, member.before / (1.0 - parameters_.cleared * parameters_.gone_in_it));
  member.kept = member.alone * (1.0 - parameters_.gone_in_it);
  return member;
}

void Patch::update(PatchMember& member, double odds, std::uint32_t missed_from) {
  check_odds(odds);
  sum_cleared_ -= member.cleared;
  sum_occluded_ -= member.occluded;

  // Likelihoods of the member's looks relative to "removed".
  member.ratio = odds / odds_of(member.before);
  const double alone = member.alone * member.ratio + 1.0 - member.alone;
  member.cleared = std::log((member.kept * member.ratio + 1.0 - member.kept) / alone);
  member.occluded = -std::log(alone);
  sum_cleared_ += member.cleared;
  sum_occluded_ += member.occluded;
  missed_from_ |= missed_from;
}

std::array<double, 3> Patch::log_weights(double cleared, double occluded) const {
  const int further = std::max(0, std::popcount(missed_from_) - 1);
  return {std::log(1.0 - parameters_.cleared - parameters_.occluded),
          std::log(parameters_.cleared) + cleared,
          std::log(parameters_.occluded) + further * std::log(parameters_.also_from) + occluded};
}

double Patch::probability(const PatchMember& member) const {
  // Probabilities of the hypotheses by the other members' looks.
  const auto [alone, cleared, occluded] =
      normalised(log_weights(sum_cleared_ - member.cleared, sum_occluded_ - member.occluded));
  const double there =
      (alone * member.alone + cleared * member.kept) * member.ratio + occluded * member.alone;
  const double gone = alone * (1.0 - member.alone) + cleared * (1.0 - member.kept) +
                      occluded * (1.0 - member.alone);
  return there / (there + gone);
}

double Patch::cleared() const { return normalised(log_weights(sum_cleared_, sum_occluded_))[1]; }

}  // namespace understory::existence
