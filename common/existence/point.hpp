// The probability that one map point still exists, and its shell of visibility.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>

#include "common/existence/histories.hpp"
#include "common/existence/look.hpp"
#include "common/existence/missed_share.hpp"
#include "common/existence/model.hpp"
#include "common/existence/odds.hpp"
#include "common/existence/pass_occluder.hpp"
#include "common/existence/saved_point.hpp"
#include "common/existence/shell.hpp"

namespace understory::existence {

/// Hidden variables: E (the point exists), D (this pass can see it, given E), V_f (the line of
/// sight from direction f is free, given E). A look sees the point with q1 = eps + (1 - eps) p_d s
/// where E, D and V_f hold, else with eps. Kept are P = p(E), d = p(D | E) and w_f = p(V_f | E, D);
/// given E and D the V_f stay independent, so within a pass the recursion is Bayes' rule itself
/// (thesis 003, Implementation 1 and 2, without its "seen means exists"):
///
///     q = w q1 + (1 - w) eps          qe = d q + (1 - d) eps
///     miss:  P : 1-P  times  1-qe : 1-eps    d : 1-d  times  1-q : 1-eps
///            w : 1-w  times  1-q1 : 1-eps
///     hit:   P : 1-P  times  qe : eps    d : 1-d  times  q : eps    w : 1-w  times  q1 : eps
///
/// At the end of a pass w <- d w + (1 - d) w(begin of the pass), and d <- v. Where the sensor
/// measured a return in front of the point, the pass may be hidden (PassOccluder): before its looks
/// D had v (1 - h), not v, and E and not D h + s (1 - v), where s is the likelihood ratio of the
/// returns for a point that stops the beams itself. The probability of E and not D does not depend
/// on the looks, so earlier looks are reweighted exactly at any change of h, in any order. Constant
/// cost: no logarithm, no exponential, odds instead of log-odds.
template <Shell S>
class PointExistence {
 public:
  /// A point from another source: P is the model's prior.
  static PointExistence known(const ExistenceModel& model) {
    PointExistence point(model, odds_of(model.parameters().prior));
    point.flags_ = kWasSure;
    return point;
  }
  /// A point at its first sighting: P is the model's share of real births; if the point is real,
  /// the pass can see it and the line of sight is free. Throws std::invalid_argument as hit() does.
  static PointExistence born(const ExistenceModel& model, const Look& look) {
    PointExistence point(model, odds_of(model.birth()));
    point.flags_ = kIsNew | kInFirstPass;
    const double odds = point.odds_;
    point.apply_hit(model, point.view_of(model, look));
    point.odds_ = odds;
    point.occluder_ = PassOccluder::refuted();
    return point;
  }

  double probability() const { return probability_of(std::min(odds_, kMostOdds)); }
  /// Log-odds in the open pass: up to 12 decades; a new pass starts from probability().
  double log_odds() const { return std::log(odds_); }
  /// p(D | E): whether this pass can see the point.
  double pass_visibility() const { return 1.0 / (1.0 + unseen_); }
  /// Sectors of the shell (bits) from which this pass missed the point.
  std::uint32_t missed_from() const { return missed_from_; }
  /// Sectors from which this pass has looked, without looks that had a return in front of the
  /// point.
  std::uint32_t looked_from() const { return missed_from_ | marked_; }
  const S& shell() const { return shell_; }

  /// The point was expected and seen. Throws std::invalid_argument where the look is not finite or
  /// has no length.
  void hit(ExistenceModel& model, const Look& look) {
    if (!look.goes_on) enter_pass(model);
    const View view = view_of(model, look);
    learn_recall(model, view, true);
    look_from(view, occluder_, Seen::kHit);
    apply_hit(model, view);
    last_hit_ = view.sector;
  }

  /// The point was expected and not seen. A blocked look is evidence on the pass, not on the point:
  /// misses without a range, earlier ones included, then have less weight.
  void miss(ExistenceModel& model, const Look& look) {
    if (!look.goes_on) enter_pass(model);
    const View view = view_of(model, look);
    const bool is_blocked = look.ray == Ray::kBlocked;
    look_from(view, occluder_.after(look.ray), is_blocked ? Seen::kNothing : Seen::kMiss);
    if (is_blocked) return;
    learn_recall(model, view, false);
    apply_miss(model, view, look.ray == Ray::kPassed);
    last_hit_ = kNowhere;
  }

  /// Time without looks. Several calls have the effect of one with their sum, except for rounding.
  void elapse(const ExistenceModel& model, const Elapsed& time) {
    odds_ = bounded(survived(odds_, time.lost));
    shell_.relax(static_cast<float>(model.parameters().visibility), time.moved);
    gap_s_ += time.dt_s;
  }

  /// Ends the point's pass if the model has begun another one; call it before the final reading of
  /// its state.
  void enter_pass(ExistenceModel& model) {
    if (pass_ != number_of(model)) change_pass(model);
  }

  /// Adds the point's history since it was last surely seen, for ExistenceModel::learn().
  void tell(PassHistories& histories) const {
    if (const auto open = history()) histories.add(*open);
  }
  /// Removes it again; call it before the point changes.
  void take_back(PassHistories& histories) const {
    if (const auto open = history()) histories.remove(*open);
  }

  /// Computes P again from the learned v and lambda, of this pass and of those before. O(1).
  void reconsider(ExistenceModel& model) { reconsider(model, model.learned().before_was); }
  /// The same for a point that missed some calls of learn(): `before_was` is LearnedRates::before
  /// at the last reconsider().
  void reconsider(ExistenceModel& model, double before_was);

  /// Applies other evidence (neighbours, other sensors): a factor on the odds of P. Throws
  /// std::invalid_argument where it is not finite or below 0.
  void multiply_odds(double ratio) {
    if (!std::isfinite(ratio) || ratio < 0.0)
      throw std::invalid_argument("existence: a likelihood ratio is not finite or below 0");
    odds_ = bounded(odds_ * ratio);
  }

  SavedPoint<S> save() const;
  /// Throws std::invalid_argument where the state has another version or shell, or is impossible.
  static PointExistence load(const ExistenceModel& model, const SavedPoint<S>& saved);

 private:
  /// A look relative to the shell.
  struct View {
    typename S::Place place;
    float distance_m = 0.0F;
    double recall = 0.0;   ///< p_d s.
    double visible = 0.0;  ///< w.
    std::uint32_t sector = 0;
  };
  enum class Seen : std::uint8_t { kHit, kMiss, kNothing };
  /// `rays` and `missed_now` of OpenHistory.
  struct RaysAndMiss {
    double rays = 1.0;
    double missed = 0.0;
  };
  static constexpr std::uint32_t kNowhere = 31;
  static constexpr std::uint32_t kSectors = 0xFFFFFF;
  static constexpr std::uint32_t kIsNew = 1;  ///< It is not yet counted as real or false.
  static constexpr std::uint32_t kInFirstPass =
      2;                                        ///< The pass that found it does not count for v.
  static constexpr std::uint32_t kWasSure = 4;  ///< Surely seen in some pass, so it is real.
  static constexpr double kUnit = 256.0;        ///< Unit of pending passes.
  static constexpr std::uint32_t kSeenEnd = 65536;
  static constexpr std::uint32_t kMissedEnd = 8192;
  static constexpr std::uint32_t kHiddenEnd = 8;
  static constexpr std::uint32_t kWhole = 255;  ///< Maximum of a share in 8 bits.
  static constexpr double kHiddenUnit = 256.0;  ///< The same for a share always below 1.
  /// A pass counts as a search for the point if a pass that can see it would have missed it with a
  /// probability below this.
  static constexpr float kLookedFor = 0.2F;

  PointExistence(const ExistenceModel& model, double odds)
      : odds_(bounded(odds)),
        shell_(model.rest_odds(), static_cast<float>(model.parameters().range_m)),
        pass_(number_of(model)) {
    start_pass(model);
  }

  /// Number of the pass in 16 bits: after 65536 passes without a look a point continues its last
  /// pass.
  static std::uint16_t number_of(const ExistenceModel& model) {
    return static_cast<std::uint16_t>(model.pass());
  }

  static double bounded(double odds) { return std::clamp(odds, kLeastOdds, kMostOddsInPass); }

  /// 1 up to the reach, 0 beyond 1.25 times the reach, smooth between.
  static double within_reach(float distance_m, float reach_m) {
    const float excess = std::clamp((distance_m / reach_m - 1.0F) * 4.0F, 0.0F, 1.0F);
    return 1.0F - excess * excess * (3.0F - 2.0F * excess);
  }

  View view_of(const ExistenceModel& model, const Look& look) const {
    const float squared = look.from_point_m.squaredNorm();
    if (!(squared > 0.0F && squared < 1e12F))
      throw std::invalid_argument("existence: a look without a finite distance");
    View view;
    view.distance_m = std::sqrt(squared);
    view.place = shell_.locate(look.from_point_m / view.distance_m);
    view.sector = static_cast<std::uint32_t>(shell_.sector(view.place));
    view.recall = model.recall().at(view.distance_m);
    view.visible = probability_of(shell_.visibility_odds(view.place));
    return view;
  }

  void apply_hit(const ExistenceModel& model, View view) {
    const double eps = model.false_rate();
    const float odds = shell_.visibility_odds(view.place);
    if (odds < kOpenedOdds) {
      shell_.multiply(view.place, kOpenedOdds / odds, model.rest_odds());
      view.visible = probability_of(kOpenedOdds);
    }
    const double q1 = eps + (1.0 - eps) * view.recall;
    const double q = view.visible * q1 + (1.0 - view.visible) * eps;
    const double d = pass_visibility();
    odds_ = bounded(odds_ * (d * q + (1.0 - d) * eps) / eps);
    scale_unseen(eps / q);
    count_look(1.0 - q);
    if (model.parameters().learn_visibility)
      shell_.multiply(view.place, static_cast<float>(q1 / eps), model.rest_odds());
    shell_.extend(view.place, view.distance_m);
  }

  void apply_miss(const ExistenceModel& model, View view, bool ray_passed) {
    const double eps = model.false_rate();
    const double recall = view.recall * within_reach(view.distance_m, shell_.reach_m(view.place));
    // A ray that passed behind the point shows a free line of sight.
    const double visible = ray_passed ? 1.0 : view.visible;
    const double unlike = 1.0 - visible * recall;  // (1 - q) / (1 - eps)
    const double d = pass_visibility();
    odds_ = bounded(odds_ * (1.0 - d * visible * recall));
    scale_unseen(1.0 / unlike);
    count_look(unlike * (1.0 - eps));
    if (ray_passed)
      count_ray(model, view);
    else if (model.parameters().learn_visibility)
      shell_.multiply(view.place, static_cast<float>(1.0 - recall), model.rest_odds());
  }

  /// Rays of one viewpoint in one pass share one cause for passing a point: they count once.
  void count_ray(const ExistenceModel& model, const View& view) {
    const std::uint32_t bit = 1U << view.sector;
    if ((rays_passed() & bit) != 0) return;
    marked_ |= bit;
    odds_ = bounded(odds_ * model.parameters().passed_by);
  }

  /// Applies a look's evidence on occlusion (range and viewpoint), before its evidence on the
  /// point. If p(H) changes, the pass so far is reweighted: d started from v (1 - h). With v = 1 no
  /// pass is hidden.
  void look_from(const View& view, PassOccluder occluder, Seen seen) {
    const std::uint32_t bit = 1U << view.sector;
    const bool is_new_side = seen != Seen::kNothing && (looked_from() & bit) == 0;
    const bool is_told = occluder.has_told() || occluder_.has_told();
    if (unseen_ > 0.0F && (is_told || (is_new_side && hidden_share_ != 0))) {
      weigh_look(bit, occluder, seen);
    } else {
      occluder_ = occluder;
      mark(bit, seen);
    }
  }
  void weigh_look(std::uint32_t bit, PassOccluder occluder, Seen seen) {
    const double was = hidden(), blind_was = blind(missed_share_);
    occluder_ = occluder;
    mark(bit, seen);
    const double is = hidden();
    if (was != is) reweigh((1.0 - is) / (1.0 - was), blind(missed_share_) / blind_was);
  }
  void mark(std::uint32_t bit, Seen seen) {
    if (seen == Seen::kNothing || (missed_from_ & bit) != 0) return;
    if (seen == Seen::kHit) marked_ |= bit;
    if (seen == Seen::kMiss) marked_ &= ~bit & kSectors;
    if (seen == Seen::kMiss) missed_from_ |= bit;
  }
  /// Reweights the pass so far for other priors: factors on E and D, and on E and not D.
  void reweigh(double seeing, double not_seeing) {
    const double d = pass_visibility();
    odds_ = bounded(odds_ * (d * seeing + (1.0 - d) * not_seeing));
    scale_unseen(not_seeing / seeing);
  }

  /// p(H): an obstacle hides the point from every viewpoint of this pass. From ranges along the
  /// rays, else from the number of sides from which the pass has looked.
  double hidden() const {
    if (occluder_.has_told()) return static_cast<double>(occluder_.chance());
    return hidden_share_ / kHiddenUnit * hides_all(std::popcount(looked_from()));
  }
  /// Likelihood ratio of the returns for an existing point, not hidden and missed; 1 - h without
  /// returns.
  double stopped_itself() const {
    return occluder_.has_told() ? occluder_.stopped_itself() : 1.0 - hidden();
  }
  /// Prior of "E and not D" with the looks' evidence on an occluder.
  double blind(MissedShare missed_share) const {
    return hidden() + stopped_itself() * missed_share.value();
  }

  void count_look(double missed) {
    keep_chance_missed(std::max(1e-6F, chance_missed() * static_cast<float>(missed)));
  }

  void scale_unseen(double ratio) {
    if (unseen_ > 0.0F) unseen_ = std::clamp(static_cast<float>(unseen_ * ratio), 1e-6F, 1e4F);
  }

  void learn_recall(ExistenceModel& model, const View& view, bool is_hit) {
    const bool is_sure = last_hit_ == view.sector && odds_ > 19.0 && unseen_ < 0.05F &&
                         view.distance_m <= shell_.reach_m(view.place);
    if (is_sure) model.recall().record_look(view.distance_m, is_hit);
  }

  // In point_learning.hpp:
  void change_pass(ExistenceModel& model);
  void learn_from_pass(ExistenceModel& model, double after, bool was_looked_for);
  void keep_pass(ExistenceModel& model);
  void weigh(ExistenceModel& model, const DecayEvidence& is);
  void pass_gap(ExistenceModel& model, double went);
  void correct_pass(const ExistenceModel& model);
  void correct_odds(const ExistenceModel& model, MissedShare before, double before_was,
                    float decay_per_s, double most_odds);
  std::optional<OpenHistory> history() const;
  double missed_by_detector() const;
  RaysAndMiss open_pass() const;
  std::uint32_t rays_passed() const { return marked_ & missed_from_; }
  double missed_passes() const { return pending_missed_ / kUnit; }
  bool has_missed() const { return missed_passes() > 0.25 || pending_hidden_ > 0; }
  bool is_pending() const { return pending_missed_ > 0 || pending_hidden_ > 0; }
  /// Likelihood ratio of the passes that missed the point, for 1 - v = `is` against `was`.
  static double missed_ratio(double is, double was, double missed, int hidden) {
    const double hidden_ratio =
        PassOccluder::missed_when_hidden(is) / PassOccluder::missed_when_hidden(was);
    return std::pow(is / was, missed) * std::pow(hidden_ratio, hidden);
  }
  /// lambda with 16 bits of its fraction.
  float decay_per_s() const { return std::bit_cast<float>(std::uint32_t{decay_bits_} << 8U); }
  void keep_decay(float per_s) {
    decay_bits_ = (std::bit_cast<std::uint32_t>(per_s) >> 8U) & 0xFFFFFFU;
  }
  float chance_missed() const { return std::bit_cast<float>(std::uint32_t{chance_bits_} << 8U); }
  void keep_chance_missed(float chance) {
    chance_bits_ = (std::bit_cast<std::uint32_t>(chance) >> 8U) & 0xFFFFFFU;
  }
  float until_missed_s() const {
    return evidence_.since_s * static_cast<float>(until_missed_) / static_cast<float>(kWhole);
  }
  bool is_surely_seen(double probability) const { return probability > 0.9 && unseen_ < 1e-3F; }
  /// Adds pending passes; the count stays below `end` / 256.
  static std::uint32_t with_pending(std::uint32_t count, double passes, std::uint32_t end) {
    return static_cast<std::uint32_t>(std::min(end - 1.0, std::round(count + kUnit * passes)));
  }

  /// Sets d, lambda and the hidden share for the pass that begins.
  void expect_pass(const ExistenceModel& model) {
    const double v = model.recall().of_pass();
    unseen_ = static_cast<float>((1.0 - v) / v);
    missed_share_ = MissedShare(1.0 - v);
    keep_decay(static_cast<float>(model.decay().mean_per_s()));
    hidden_share_ = static_cast<std::uint32_t>(kHiddenUnit * model.hidden()) & 0xFFU;
  }

  void start_pass(const ExistenceModel& model) {
    expect_pass(model);
    keep_chance_missed(1.0F);
    marked_ = 0;
    missed_from_ = 0;
    last_hit_ = kNowhere;
    gap_s_ = 0.0F;
    occluder_ = {};
    pass_ = number_of(model);
    odds_ = std::min(odds_, kMostOdds);
    shell_.begin_pass();
  }

  double odds_;  ///< P / (1 - P).
  S shell_;
  std::uint16_t pass_;
  MissedShare missed_share_;  ///< 1 - v at the begin of the pass.
  /// Sectors of this pass: with a miss, rays passed the point; else every look saw it.
  std::uint32_t marked_ : 24 = 0;
  std::uint32_t last_hit_ : 5 = kNowhere;  ///< Sector of the pass's last look, if it was a hit.
  std::uint32_t flags_ : 3 = 0;
  std::uint32_t missed_from_ : 24 = 0;  ///< Sectors of this pass with misses.
  PassOccluder occluder_;  ///< Occluder of this pass, in the last byte of the sectors' word.
  float unseen_ = 0.0F;    ///< (1 - d) / d.
  /// Probability of the misses so far for a pass that can see it: first bits of a float.
  std::uint32_t chance_bits_ : 24 = 0;
  std::uint32_t hidden_share_ : 8 = 0;  ///< ExistenceModel::hidden() at the begin of the pass.
  /// Passes that can see the point, since it was surely seen [1 / 256].
  std::uint16_t pending_seen_ = 0;
  std::uint16_t pending_missed_ : 13 = 0;  ///< Passes that missed it since then [1 / 256].
  std::uint16_t pending_hidden_ : 3 = 0;   ///< Hidden passes since then.
  DecayEvidence evidence_;                 ///< Evidence up to the begin of this pass.
  std::uint32_t decay_bits_ : 24 = 0;  ///< lambda at the begin of the pass: first bits of a float.
  std::uint32_t until_missed_ : 8 = kWhole;  ///< Share of evidence_.since_s, see OpenHistory.
  float gap_s_ = 0.0F;                       ///< Time without looks since this pass began.
};

}  // namespace understory::existence

#include "common/existence/point_learning.hpp"  // IWYU pragma: export
#include "common/existence/point_saving.hpp"    // IWYU pragma: export
