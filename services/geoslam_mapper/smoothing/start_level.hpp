// Level error at the start of the map, estimated from the vehicle's later motion.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/model/archive.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A stationary vehicle cannot distinguish a level error from the accelerometer's bias. So the
/// first keyframe's landmarks are displaced by their height times that error, about a centimetre,
/// until the first metres show it (REST_LEVEL). Owns the estimate of that error. Cost: constant.
class StartLevel {
 public:
  /// Sets the first keyframe, at `utime`, and the level estimate used for it.
  void begin(model::Utime utime, const std::optional<model::EkfLevel>& level);
  /// Adds a later estimate for a rest; ignored if the rest is not the start, or the estimate is not
  /// better.
  void add(const model::RestLevel& level);

  /// Error (roll, pitch) of the first keyframe's level [rad], and the time until which sweeps were
  /// levelled without this estimate.
  struct Found {
    Eigen::Vector2d error_rad = Eigen::Vector2d::Zero();
    model::Utime until = 0;

    /// Members of a saved state; see common/state.
    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.error_rad, s.until);
    }
  };
  /// Change of the estimate since the last call; none if it is smaller than kLeast_rad.
  std::optional<Found> take();
  /// Covariance of the displacement of the vehicle in the map by the remaining error [rad^2]; zero
  /// if it was never known. While sweeps are levelled with the same error as the start, it is
  /// smaller than that of the error itself, since the error displaces all positions alike.
  const Eigen::Matrix2d& covariance() const {
    return change_ && change_->trace() < covariance_.trace() ? *change_ : covariance_;
  }
  /// 0.1 mm at breast height.
  static constexpr double kLeast_rad = 1e-4;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime_, self.levelled_by_rad_, self.covariance_, self.change_, self.found_rad_,
      self.found_utime_, self.taken_);
  }

 private:
  std::optional<model::Utime> utime_;  ///< None before the map begins.
  Eigen::Vector2d levelled_by_rad_ =
      Eigen::Vector2d::Zero();                            ///< The error estimate used at the start.
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();  ///< Of the remaining error.
  /// Covariance of the difference to the present level error of sweeps; none if unknown.
  std::optional<Eigen::Matrix2d> change_;
  Eigen::Vector2d found_rad_ = Eigen::Vector2d::Zero();  ///< The error beyond levelled_by_rad_.
  model::Utime found_utime_ = 0;  ///< Time until which measurements are included.
  Found taken_;
};

}  // namespace understory::geoslam_mapper::smoothing
