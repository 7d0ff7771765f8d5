#include "services/geoslam_mapper/smoothing/start_level.hpp"

namespace understory::geoslam_mapper::smoothing {

void StartLevel::begin(model::Utime utime, const std::optional<model::EkfLevel>& level) {
  *this = {};
  utime_ = utime;
  if (!level) return;
  levelled_by_rad_ = level->error_rad;
  covariance_ = level->covariance;
}

void StartLevel::add(const model::RestLevel& level) {
  if (!utime_ || *utime_ > level.rest_utime) return;
  change_.reset();
  if (*utime_ < level.rest_from_utime) return;  // About a later rest.

  change_ = level.change_covariance;
  const bool is_known = !covariance_.isZero(0.0);
  if (is_known && level.covariance.trace() > covariance_.trace()) return;
  covariance_ = level.covariance;
  found_rad_ = level.error_rad - levelled_by_rad_;
  found_utime_ = level.utime;
  if (taken_.until == 0) taken_.until = level.rest_utime;
}

std::optional<StartLevel::Found> StartLevel::take() {
  const Found found{found_rad_ - taken_.error_rad, taken_.until};
  if (found.error_rad.norm() < kLeast_rad) return std::nullopt;
  taken_ = {found_rad_, found_utime_};
  return found;
}

}  // namespace understory::geoslam_mapper::smoothing
