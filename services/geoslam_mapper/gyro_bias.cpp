#include "services/geoslam_mapper/gyro_bias.hpp"

namespace understory {
namespace {

/// One variable for so long: the bias walks by a third of what is ever known of it.
constexpr Utime kLasts_us = 5'000'000;

double seconds(Utime duration) { return 1e-6 * static_cast<double>(duration); }

}  // namespace

void GyroBias::learn_from(const FilterBias& filter, Utime utime, Smoother& smoother) {
  if (!newest_) {
    reference_ = filter.bias;
    newest_ = Newest{smoother.add_scalar(0.0), utime};
    smoother.add(ScalarPrior{newest_->id, 0.0, 1.0 / filter.variance});
    return;
  }
  if (utime - newest_->since > kLasts_us) {
    const ScalarId next = smoother.add_scalar(smoother.scalar(newest_->id));
    const double variance = walk_ * walk_ * seconds(utime - newest_->since);
    smoother.add(ScalarStep{newest_->id, next, 1.0 / variance});
    newest_ = Newest{next, utime};
  }
  if (!stood_) return;
  // The difference of the two words of the filter is what standing told.
  const double before = 1.0 / (before_.variance + walk_ * walk_ * seconds(utime - before_utime_));
  const double gained = 1.0 / filter.variance - before;
  if (gained <= 0.0) return;
  const double told = (filter.bias / filter.variance - before_.bias * before) / gained;
  smoother.add(ScalarPrior{newest_->id, told - reference_, gained});
}

void GyroBias::add_motion(const RelativePose& motion, const GyroTurn& turn,
                          const FilterBias& filter, Utime utime, Smoother& smoother) {
  learn_from(filter, utime, smoother);
  stood_ = false;
  before_ = filter;
  before_utime_ = utime;
  // As it would have been measured with the reference taken out.
  RelativePose measured = motion;
  measured.a_T_b =
      at_true_rate(motion.a_T_b, reference_ - turn.bias_rad / turn.seconds, turn.seconds);
  smoother.add(TurningPose{measured, newest_->id, turn.seconds});
}

Json GyroBias::save() const {
  return {reference_,       newest_ ? Json{index(newest_->id), newest_->since} : Json(nullptr),
          stood_,           before_.bias,
          before_.variance, before_utime_};
}

void GyroBias::load(const Json& json) {
  json.at(0).get_to(reference_);
  newest_.reset();
  if (!json.at(1).is_null())
    newest_ =
        Newest{ScalarId(json.at(1).at(0).get<std::uint32_t>()), json.at(1).at(1).get<Utime>()};
  json.at(2).get_to(stood_);
  json.at(3).get_to(before_.bias);
  json.at(4).get_to(before_.variance);
  json.at(5).get_to(before_utime_);
}

}  // namespace understory
