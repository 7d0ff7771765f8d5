#include "common/existence/model.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "common/existence/odds.hpp"

namespace understory::existence {
namespace {

/// Initial weight of the share of real births, in points.
constexpr double kBirthWeight = 10.0;

void require(bool holds, const char* name, double value, const char* allowed) {
  if (holds) return;
  throw std::invalid_argument("existence: " + std::string(name) + " = " + std::to_string(value) +
                              ", allowed: " + allowed);
}

void require_share(double value, const char* name) {
  require(value > 0.0 && value < 1.0, name, value, "above 0, below 1");
}

void require_count(double value, const char* name, double least) {
  require(std::isfinite(value) && value >= least, name, value, "finite, not below its least");
}

}  // namespace

void check(const Parameters& parameters) {
  require_share(parameters.prior, "prior");
  require_share(parameters.birth, "birth");
  require_share(parameters.visibility, "visibility");
  require_share(parameters.recall, "recall");
  require_share(parameters.passed_by, "passed_by");
  require(parameters.false_rate >= 1e-9 && parameters.false_rate < 0.5, "false_rate",
          parameters.false_rate, "1e-9 to 0.5");
  require(parameters.pass_recall > 0.0 && parameters.pass_recall <= 1.0, "pass_recall",
          parameters.pass_recall, "above 0, up to 1");
  require_count(parameters.recall_weight, "recall_weight", 1.0);
  require_count(parameters.pass_recall_weight, "pass_recall_weight", 1.0);
  require_count(parameters.drives_alike, "drives_alike", 1.0);
  require_share(parameters.drives_unlike, "drives_unlike");
  require_share(parameters.drives_hidden, "drives_hidden");
  require_count(parameters.decay_per_s, "decay_per_s", 0.0);
  require_count(parameters.decay_weight, "decay_weight", 0.0);
  require_count(parameters.relax_per_s, "relax_per_s", 0.0);
  require(std::isfinite(parameters.range_m) && parameters.range_m > 0.0, "range_m",
          parameters.range_m, "above 0 m");
}

ExistenceModel::ExistenceModel(const Parameters& parameters)
    : parameters_((check(parameters), parameters)),
      recall_(parameters),
      decay_(parameters.decay_per_s, parameters.decay_weight),
      births_{kBirthWeight * parameters.birth, kBirthWeight * (1.0 - parameters.birth)},
      rest_odds_(static_cast<float>(odds_of(parameters.visibility))) {}

Elapsed ExistenceModel::elapsed(double dt_s) const {
  require_count(dt_s, "dt_s", 0.0);
  return {static_cast<float>(dt_s), lost_share(decay_.mean_per_s(), dt_s),
          static_cast<float>(lost_share(parameters_.relax_per_s, dt_s))};
}

void ExistenceModel::learn(const PassHistories& histories) {
  const Parameters& stated = parameters_;
  const RatePriors priors{stated.pass_recall_weight * stated.pass_recall,
                          stated.pass_recall_weight * (1.0 - stated.pass_recall),
                          stated.decay_weight,
                          stated.decay_per_s > 0.0 ? stated.decay_weight / stated.decay_per_s : 0.0,
                          stated.drives_alike,
                          stated.drives_unlike,
                          stated.drives_hidden,
                          stated.passed_by};
  if (learned_.now == 0.0) {
    learned_.now = learned_.before = stated.pass_recall;
    record_passes(priors.seen, priors.missed);
  }
  learned_.decay_per_s = decay_.mean_per_s();
  learned_ = histories.rates(learned_, priors, decay_.went(), decay_.exposure_s(),
                             recall_.learns_passes(), decay_.is_learned());
  hold();
}

void ExistenceModel::begin_drive() {
  begin_pass();
  if (learned_.now == 0.0) return;
  learned_.before_was = learned_.before;
  learned_.now = learned_.before;
  learned_.hidden = 0.0;
  hold();
}

void ExistenceModel::record_passes(double seen, double missed) {
  learned_.before_seen += seen;
  learned_.before_missed += missed;
}

void ExistenceModel::hold() {
  if (recall_.learns_passes()) recall_.hold(learned_.now);
  if (decay_.is_learned()) decay_.hold(learned_.decay_per_s);
}

SavedModel ExistenceModel::save() const {
  SavedModel saved;
  saved.pass = pass_;
  saved.recall = recall_.store();
  saved.births = {births_.hits, births_.misses};
  saved.decay = {decay_.went(), decay_.exposure_s()};
  saved.learned = learned_.store();
  return saved;
}

void ExistenceModel::load(const SavedModel& saved) {
  if (saved.version < 1 || saved.version > SavedModel::kVersion ||
      saved.pass > std::numeric_limits<std::uint32_t>::max())
    throw std::invalid_argument("existence: a saved model of another version");
  for (const double count : saved.births) require_count(count, "births", 0.0);
  require(saved.births[0] + saved.births[1] > 0.0, "births", 0.0, "above 0");
  ExistenceModel loaded = *this;
  loaded.recall_.restore(saved.recall);
  loaded.decay_.restore(saved.decay[0], saved.decay[1]);
  loaded.learned_ = LearnedRates::restored(saved.learned);
  if (loaded.learned_.now > 0.0) loaded.hold();
  loaded.births_ = {saved.births[0], saved.births[1]};
  loaded.pass_ = static_cast<std::uint32_t>(saved.pass);
  *this = loaded;
}

}  // namespace understory::existence
