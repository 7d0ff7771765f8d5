// Learning from a point's passes, and the correction of the point by the learned rates. Part of
// point.hpp.
#pragma once

#include "common/existence/point.hpp"

namespace understory::existence {

template <Shell S>
std::optional<OpenHistory> PointExistence<S>::history() const {
  if ((flags_ & kWasSure) == 0) return std::nullopt;
  const bool has_looked = (flags_ & kInFirstPass) == 0 && chance_missed() < kLookedFor;
  const bool is_seen = has_looked && is_surely_seen(probability());
  const bool has_rays = (flags_ & kInFirstPass) == 0 && occluder_.chance() > 0.0F;
  const bool is_open = (has_looked || has_rays) && !is_seen;
  const bool may_be_hidden = has_looked && !occluder_.has_told();
  const RaysAndMiss open = is_open ? open_pass() : RaysAndMiss{};
  return OpenHistory{.missed_before = missed_passes(),
                     .hidden_before = pending_hidden_,
                     .missed_now = open.missed,
                     .rays = open.rays,
                     .passed = is_open ? std::popcount(rays_passed()) : 0,
                     .sides = may_be_hidden ? std::popcount(looked_from()) : 0,
                     .is_seen_now = is_seen,
                     .since_s = evidence_.since_s,
                     .until_missed_s = until_missed_s(),
                     .counted = evidence_};
}

/// Likelihood ratio of the looks against a removed point: h + s (1 - v) + (1 - h) L / L0 v. L / L0
/// follows from the odds of D; v cancels, and so does occlusion without a return.
template <Shell S>
typename PointExistence<S>::RaysAndMiss PointExistence<S>::open_pass() const {
  if (unseen_ <= 0.0F) return {};
  const double by_rays = occluder_.chance(), itself = occluder_.stopped_itself();
  const double free = (1.0 - hidden()) / (1.0 - by_rays);
  const double seeing = blind(missed_share_) / ((1.0 - missed_share_.value()) * unseen_ * free);
  const double unseen = by_rays + itself;
  return {unseen, std::clamp((itself - seeing) / unseen, 0.0, 1.0)};
}

template <Shell S>
void PointExistence<S>::reconsider(ExistenceModel& model, double before_was) {
  if ((flags_ & kInFirstPass) != 0) return;
  const MissedShare missed_share = missed_share_;
  const float decay_per_s = this->decay_per_s();
  const bool has_looked = chance_missed() < 1.0F || !occluder_.is_new();
  has_looked ? correct_pass(model) : expect_pass(model);
  correct_odds(model, missed_share, before_was, decay_per_s,
               has_looked ? kMostOddsInPass : kMostOdds);
  if (is_pending() && !has_looked)
    weigh(model, {static_cast<float>(1.0 - probability()), evidence_.since_s});
}

/// Reweights the pass so far for the present v and hidden share.
template <Shell S>
void PointExistence<S>::correct_pass(const ExistenceModel& model) {
  const double was = (1.0 - missed_share_.value()) * (1.0 - hidden());
  const double blind_was = blind(missed_share_);
  const float unseen = unseen_;
  expect_pass(model);
  const double is = (1.0 - missed_share_.value()) * (1.0 - hidden());
  unseen_ = unseen;
  if (unseen > 0.0F) reweigh(is / was, blind(missed_share_) / blind_was);
}

template <Shell S>
void PointExistence<S>::change_pass(ExistenceModel& model) {
  shell_.end_pass(static_cast<float>(pass_visibility()));
  // P after the looks, before time lowered it.
  const double lost = lost_share(model.decay().mean_per_s(), gap_s_);
  const double after = std::min(1.0, probability() / (1.0 - lost));
  const bool was_looked_for = chance_missed() < kLookedFor;
  const double missed_before = missed_passes();
  const int hidden_before = pending_hidden_;
  if ((flags_ & kIsNew) != 0 && was_looked_for) {
    model.record_birth(after);
    flags_ &= ~kIsNew & 7U;
  }
  learn_from_pass(model, after, was_looked_for);
  const double missed = std::max(0.0, missed_passes() - missed_before);
  const int hidden = std::max(0, pending_hidden_ - hidden_before);
  flags_ &= ~kInFirstPass & 7U;

  const double still = (1.0 - static_cast<double>(evidence_.went)) * (1.0 - lost);
  pass_gap(model, 1.0 - still);
  const MissedShare missed_share = missed_share_;
  const float decay_per_s = this->decay_per_s();
  start_pass(model);
  const LearnedRates& learned = model.learned();
  if (learned.now > 0.0)
    odds_ =
        bounded(odds_ * missed_ratio(1.0 - learned.before, missed_share.value(), missed, hidden));
  else if (is_pending())
    correct_odds(model, missed_share, learned.before_was, decay_per_s, kMostOdds);
}

/// Applies the time without looks since this pass began.
template <Shell S>
void PointExistence<S>::pass_gap(ExistenceModel& model, double went) {
  const float since_s = evidence_.since_s + gap_s_;
  const float until_s = has_missed() ? until_missed_s() : since_s;
  weigh(model, {static_cast<float>(went), since_s});
  const float share = since_s > 0.0F ? until_s / since_s : 1.0F;
  until_missed_ =
      static_cast<std::uint32_t>(std::round(std::clamp(share, 0.0F, 1.0F) * kWhole)) & kWhole;
}

/// Learns the recall of passes and the decay. Passes since the last sure sighting count with the
/// probability that the point still exists.
template <Shell S>
void PointExistence<S>::learn_from_pass(ExistenceModel& model, double after, bool was_looked_for) {
  const bool counts = was_looked_for && (flags_ & kInFirstPass) == 0;
  const bool is_sure = is_surely_seen(after);
  if (is_sure && counts) {
    const double hidden = PassOccluder::missed_itself(1.0 - model.learned().before);
    model.record_passes(1.0, missed_passes() + hidden * pending_hidden_);
  }
  if (counts) keep_pass(model);
  weigh(model, {is_sure ? 0.0F : static_cast<float>(1.0 - after), evidence_.since_s});
  if (!is_sure) return;
  flags_ |= kWasSure;
  pending_seen_ = pending_missed_ = pending_hidden_ = 0;
  until_missed_ = kWhole;
  evidence_ = {};
}

/// Adds the pass to the pending ones. The miss of a hidden pass depends on v, so it is counted
/// separately.
template <Shell S>
void PointExistence<S>::keep_pass(ExistenceModel& model) {
  const std::uint32_t seen = pending_seen_, missed = pending_missed_;
  pending_seen_ = with_pending(seen, pass_visibility(), kSeenEnd) & 0xFFFFU;
  if (!occluder_.is_hidden_pass())
    pending_missed_ = with_pending(missed, missed_by_detector(), kMissedEnd) & (kMissedEnd - 1);
  else if (pass_visibility() < 0.5)
    pending_hidden_ = std::min(pending_hidden_ + 1U, kHiddenEnd - 1) & (kHiddenEnd - 1);
  const double weight = (1.0 - static_cast<double>(evidence_.went)) / kUnit;
  model.recall().record_passes(weight * (pending_seen_ - seen),
                               weight * (pending_missed_ - missed));
}

/// Probability that the detector missed the point in this pass; a hidden point is no evidence on
/// the detector.
template <Shell S>
double PointExistence<S>::missed_by_detector() const {
  const double missed = stopped_itself() * missed_share_.value();
  return (1.0 - pass_visibility()) * missed / blind(missed_share_);
}

/// Replaces the point's contribution to the counts.
template <Shell S>
void PointExistence<S>::weigh(ExistenceModel& model, const DecayEvidence& is) {
  if ((flags_ & kWasSure) != 0) model.decay().replace(evidence_, is);
  const double more = (static_cast<double>(evidence_.went) - static_cast<double>(is.went)) / kUnit;
  if (pending_seen_ + pending_missed_ > 0)
    model.recall().record_passes(more * pending_seen_, more * pending_missed_);
  evidence_ = is;
}

/// Corrects P for the present v and lambda since the last sure sighting: each missed pass has the
/// factor 1 - v, and the odds of survival follow from lambda.
template <Shell S>
void PointExistence<S>::correct_odds(const ExistenceModel& model, MissedShare before,
                                     double before_was, float decay_per_s, double most_odds) {
  if ((flags_ & kWasSure) == 0) return;
  const LearnedRates& learned = model.learned();
  if (learned.now > 0.0)
    odds_ *= missed_ratio(1.0 - learned.before, 1.0 - before_was, missed_passes(), pending_hidden_);
  else
    odds_ *=
        missed_ratio(missed_share_.stepped(), before.stepped(), missed_passes(), pending_hidden_);
  const auto odds_of_survival = [&](double rate_per_s) {
    return odds_of(1.0 - std::clamp(lost_share(rate_per_s, evidence_.since_s), 1e-9, 1.0 - 1e-9));
  };
  if (decay_per_s > 0.0F)
    odds_ *= odds_of_survival(model.decay().mean_per_s()) / odds_of_survival(decay_per_s);
  odds_ = bounded(std::min(odds_, most_odds));
}

}  // namespace understory::existence
