#include "services/geoslam_mapper/smoothing/gyro_bias.hpp"

#include <cmath>

#include "common/geometry/decompositions.hpp"

namespace understory::geoslam_mapper::smoothing {
namespace {

namespace plane = factor_graph::plane;

/// Duration of one scalar: in this time the bias walks by a third of its smallest uncertainty.
constexpr model::Utime kValidity_us = 5'000'000;
/// Number of newest scalars that may still lose their motions: those of the last keyframes.
constexpr std::size_t kChain = 64;
/// Factor on the variance of a prior that repeats information still in the graph. The removed
/// motions are at least three quarters of that information.
constexpr double kRepeated = 1.3;

double seconds(model::Utime duration) { return 1e-6 * static_cast<double>(duration); }

/// The covariance with the gyro's variance for the rotation, with the same correlations.
Eigen::Matrix3d with_heading_variance(Eigen::Matrix3d covariance, double variance) {
  const double ratio = std::sqrt(variance / covariance(2, 2));
  covariance.row(2) *= ratio;
  covariance.col(2) *= ratio;
  return covariance;
}

/// Adds the factor, in a free place if there is one.
template <typename Id, typename Factor>
Id put(const Factor& factor, FreeNumbers& free, plane::Smoother& smoother) {
  const auto number = free.take();
  if (!number) return smoother.add(factor);
  smoother.set(Id(*number), factor);
  return Id(*number);
}

}  // namespace

void GyroBias::checkpoint() {
  saved_ = now_;
  free_scalars_.checkpoint();
  free_priors_.checkpoint();
  free_steps_.checkpoint();
}

void GyroBias::rollback() {
  now_ = saved_;
  free_scalars_.rollback();
  free_priors_.rollback();
  free_steps_.rollback();
}

void GyroBias::add_link(double initial, model::Utime utime, plane::Smoother& smoother) {
  Link link;
  link.since = utime;
  if (const auto number = free_scalars_.take()) {
    link.id = plane::ScalarId(*number);
    smoother.restart(link.id, initial);
  } else {
    link.id = smoother.add_scalar(initial);
  }
  if (now_.chain.size() >= kChain) now_.chain.erase(now_.chain.begin());
  now_.chain.push_back(link);
}

void GyroBias::set_prior(Link& link, double mean, double information, plane::Smoother& smoother) {
  const plane::ScalarPrior factor{link.id, mean, information};
  if (link.prior) {
    smoother.set(*link.prior, factor);
  } else {
    link.prior = put<plane::ScalarPriorId>(factor, free_priors_, smoother);
  }
}

/// A further prior is averaged with the first.
void GyroBias::add_prior(Link& link, double mean, double information, plane::Smoother& smoother) {
  if (!link.prior) return set_prior(link, mean, information, smoother);
  const plane::ScalarPrior& before = smoother.prior(*link.prior);
  const double sum = before.information + information;
  set_prior(link, (before.information * before.mean + information * mean) / sum, sum, smoother);
}

void GyroBias::set_step(Link& link, plane::ScalarId from, double information,
                        plane::Smoother& smoother) {
  const plane::ScalarStep factor{from, link.id, information};
  if (link.step) {
    smoother.set(*link.step, factor);
  } else {
    link.step = put<plane::ScalarStepId>(factor, free_steps_, smoother);
  }
}

/// Removes the link's own factors.
void GyroBias::clear(Link& link, plane::Smoother& smoother) {
  if (link.prior) {
    smoother.set(*link.prior, plane::ScalarPrior{link.id, 0.0, 0.0});
    free_priors_.give(index(*link.prior));
    link.prior.reset();
  }
  if (link.step) {
    smoother.set(*link.step, plane::ScalarStep{link.id, link.id, 0.0});
    free_steps_.give(index(*link.step));
    link.step.reset();
  }
}

/// Adds scalars up to the time of this motion.
void GyroBias::go_on(const CentreMotion& motion, plane::Smoother& smoother) {
  if (now_.chain.empty()) {
    now_.reference = motion.odometry_bias;
    add_link(0.0, motion.utime, smoother);
    set_prior(now_.chain.back(), 0.0, 1.0 / (start_sigma_ * start_sigma_), smoother);
  } else if (const Link newest = now_.chain.back(); motion.utime - newest.since > kValidity_us) {
    add_link(smoother.scalar(newest.id), motion.utime, smoother);
    const double variance = walk_ * walk_ * seconds(motion.utime - newest.since);
    set_step(now_.chain.back(), newest.id, 1.0 / variance, smoother);
  }

  if (motion.at_stops) {
    add_prior(now_.chain.back(), motion.at_stops->bias - now_.reference,
              1.0 / motion.at_stops->variance, smoother);
  }
}

plane::BiasedRelativePose GyroBias::biased(plane::RelativePose measured, const CentreMotion& motion,
                                           plane::Smoother& smoother) {
  go_on(motion, smoother);

  // The rotation with the reference bias subtracted.
  const model::GyroRotation& gyro = *motion.gyro;
  const geometry::SE2 by_gyro(motion.from_T_to.mean.translation(), gyro.rotation_rad);
  measured.a_T_b =
      plane::at_true_rate(by_gyro, now_.reference - gyro.bias_rad / gyro.seconds, gyro.seconds);
  measured.information = geometry::symmetric_inverse(
      with_heading_variance(motion.from_T_to.covariance, gyro.variance));
  ++now_.chain.back().motions;
  return {measured, now_.chain.back().id, gyro.seconds};
}

std::optional<GyroBias::Estimate> GyroBias::estimate(const plane::Smoother& smoother) const {
  if (now_.chain.empty()) return std::nullopt;
  const plane::ScalarId newest = now_.chain.back().id;
  const auto variance = smoother.variance(newest);
  if (!variance || *variance <= 0.0) return std::nullopt;
  return Estimate{smoother.scalar(newest), *variance};
}

void GyroBias::forget_motion(plane::ScalarId id) {
  for (Link& link : now_.chain) {
    if (link.id == id) --link.motions;
  }
}

/// Ties the next link to the previous one: variances of random walks add up.
void GyroBias::take_out(std::size_t at, plane::Smoother& smoother) {
  Link& link = now_.chain[at];
  Link& next = now_.chain[at + 1];
  if (next.step) {
    const double variance = 1.0 / smoother.step(*next.step).information;
    if (link.prior) {
      const plane::ScalarPrior prior = smoother.prior(*link.prior);
      add_prior(next, prior.mean, 1.0 / (1.0 / prior.information + variance), smoother);
    }
    if (link.step) {
      const plane::ScalarStep step = smoother.step(*link.step);
      set_step(next, step.a, 1.0 / (1.0 / step.information + variance), smoother);
    } else {
      smoother.set(*next.step, plane::ScalarStep{next.id, next.id, 0.0});
      free_steps_.give(index(*next.step));
      next.step.reset();
    }
  }
  clear(link, smoother);
  free_scalars_.give(index(link.id));
  now_.chain.erase(now_.chain.begin() + static_cast<std::ptrdiff_t>(at));
}

void GyroBias::learned(plane::ScalarId id, double mean, double information,
                       plane::Smoother& smoother) {
  for (Link& link : now_.chain) {
    if (link.id == id) add_prior(link, mean, information, smoother);
  }
}

void GyroBias::drop_idle(plane::Smoother& smoother) {
  for (std::size_t i = 0; i + 1 < now_.chain.size();) {
    if (now_.chain[i].motions == 0) {
      take_out(i, smoother);
    } else {
      ++i;
    }
  }
}

void GyroBias::keep(const Estimate& before, plane::Smoother& smoother) {
  drop_idle(smoother);
  Link& newest = now_.chain.back();
  clear(newest, smoother);
  set_prior(newest, before.mean, 1.0 / (kRepeated * before.variance), smoother);
}

}  // namespace understory::geoslam_mapper::smoothing
