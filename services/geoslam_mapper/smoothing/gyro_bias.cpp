#include "services/geoslam_mapper/smoothing/gyro_bias.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

/// One variable for so long: the bias walks by a third of what is ever known of it.
constexpr model::Utime kLasts_us = 5'000'000;

double seconds(model::Utime duration) { return 1e-6 * static_cast<double>(duration); }

}  // namespace

void GyroBias::learn_from(const model::FilterBias& filter, model::Utime utime,
                          factor_graph::plane::Smoother& smoother) {
  if (!newest_) {
    reference_ = filter.bias;
    newest_ = Newest{smoother.add_scalar(0.0), utime};
    smoother.add(factor_graph::plane::ScalarPrior{newest_->id, 0.0, 1.0 / filter.variance});
    return;
  }
  if (utime - newest_->since > kLasts_us) {
    const factor_graph::plane::ScalarId next = smoother.add_scalar(smoother.scalar(newest_->id));
    const double variance = walk_ * walk_ * seconds(utime - newest_->since);
    smoother.add(factor_graph::plane::ScalarStep{newest_->id, next, 1.0 / variance});
    newest_ = Newest{next, utime};
  }
  if (!was_stationary_) return;
  // The difference of the two words of the filter is what standing told.
  const double before = 1.0 / (before_.variance + walk_ * walk_ * seconds(utime - before_utime_));
  const double gained = 1.0 / filter.variance - before;
  if (gained <= 0.0) return;
  const double told = (filter.bias / filter.variance - before_.bias * before) / gained;
  smoother.add(factor_graph::plane::ScalarPrior{newest_->id, told - reference_, gained});
}

void GyroBias::add_motion(const factor_graph::plane::RelativePose& motion,
                          const model::GyroRotation& turn, const model::FilterBias& filter,
                          model::Utime utime, factor_graph::plane::Smoother& smoother) {
  learn_from(filter, utime, smoother);
  was_stationary_ = false;
  before_ = filter;
  before_utime_ = utime;
  // As it would have been measured with the reference taken out.
  factor_graph::plane::RelativePose measured = motion;
  measured.a_T_b = factor_graph::plane::at_true_rate(
      motion.a_T_b, reference_ - turn.bias_rad / turn.seconds, turn.seconds);
  smoother.add(factor_graph::plane::BiasedRelativePose{measured, newest_->id, turn.seconds});
}

model::Json GyroBias::save() const {
  return {reference_,
          newest_ ? model::Json{index(newest_->id), newest_->since} : model::Json(nullptr),
          was_stationary_,
          before_.bias,
          before_.variance,
          before_utime_};
}

void GyroBias::load(const model::Json& json) {
  json.at(0).get_to(reference_);
  newest_.reset();
  if (!json.at(1).is_null())
    newest_ = Newest{factor_graph::plane::ScalarId(json.at(1).at(0).get<std::uint32_t>()),
                     json.at(1).at(1).get<model::Utime>()};
  json.at(2).get_to(was_stationary_);
  json.at(3).get_to(before_.bias);
  json.at(4).get_to(before_.variance);
  json.at(5).get_to(before_utime_);
}

}  // namespace understory::geoslam_mapper::smoothing
