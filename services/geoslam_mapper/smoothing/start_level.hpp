// What the vehicle's motion shows later of the level's error at the start of the map.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/model/archive.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A stationary vehicle cannot tell an error of the level from the accelerometer's bias. So the
/// first keyframe's landmarks are displaced by their height times that error, a centimetre, until
/// the first metres show it (REST_LEVEL). Owns what is known of it. Cost: constant.
class StartLevel {
 public:
  /// The first keyframe, at `utime`, and the level with which it was levelled.
  void begin(model::Utime utime, const std::optional<model::EkfLevel>& level);
  /// Later knowledge of a rest; nothing where that was not at the start, or is not better.
  void add(const model::RestLevel& level);

  /// Error (roll, pitch) of the first keyframe's level [rad], and until when sweeps were levelled
  /// without knowing of it.
  struct Found {
    Eigen::Vector2d error_rad = Eigen::Vector2d::Zero();
    model::Utime until = 0;

    /// Members of a saved state; see common/state.
    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.error_rad, s.until);
    }
  };
  /// What was found beyond what was taken by the last call; none where that is less than kLeast_rad
  /// in size.
  std::optional<Found> take();
  /// Covariance of what the error does to where the vehicle is in the map [rad^2]; zero where it
  /// was never known. As long as sweeps are levelled with the error of the start that is less than
  /// what remains of it, since it displaces all alike.
  const Eigen::Matrix2d& covariance() const {
    return change_ && change_->trace() < covariance_.trace() ? *change_ : covariance_;
  }
  /// A tenth of a millimetre at breast height.
  static constexpr double kLeast_rad = 1e-4;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.utime_, self.levelled_by_rad_, self.covariance_, self.change_, self.found_rad_,
      self.found_utime_, self.taken_);
  }

 private:
  std::optional<model::Utime> utime_;                          ///< None before the map begins.
  Eigen::Vector2d levelled_by_rad_ = Eigen::Vector2d::Zero();  ///< The error as known at first.
  Eigen::Matrix2d covariance_ = Eigen::Matrix2d::Zero();       ///< Of what remains of it.
  /// Of the difference to the level error of sweeps now; none where it is not known.
  std::optional<Eigen::Matrix2d> change_;
  Eigen::Vector2d found_rad_ = Eigen::Vector2d::Zero();  ///< The error beyond that.
  model::Utime found_utime_ = 0;                         ///< By what was measured until then.
  Found taken_;
};

}  // namespace understory::geoslam_mapper::smoothing
