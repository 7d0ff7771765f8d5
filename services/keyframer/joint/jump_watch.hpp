// Detects a jump of the scans' clock, or of the landmarks' frame, against odometry.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "services/keyframer/joint/motion_difference.hpp"

namespace understory::keyframer::joint {

/// Averages the residuals of the last motions after calibration, in the axes of their ends.
///
/// After a jump all motions across it have the same residual: a clock that jumps by tau gives -tau
/// xi, with the twist xi of the vehicle. Each of them has the noise of two other scans, so the
/// landmarks' noise in the mean of n has 1/n of the variance. The motions are short, so wheels add
/// little error. The scatter of the mean without a jump is estimated as well, since wheels slip by
/// more than they state.
class JumpWatch {
 public:
  /// Scans per motion, and motions in the mean: no two share a scan.
  static constexpr std::size_t kScans = 5;

  /// Adds the next motion. `calibration`: the estimate before it, and its covariance. Cost: a few 3
  /// x 3 matrices.
  void add(const TwoMotions& motions, const CalibrationNumbers& calibration,
           const CalibrationMatrix& covariance);
  /// Restarts the mean after a gap in tracking or odometry.
  void begin_anew() {
    count_ = 0;
    late_sigmas_ = 0.0;
  }

  /// Size of the jump of the clock in sigmas; 0 until there are enough motions.
  double late_sigmas() const { return late_sigmas_; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.motions_, self.count_, self.scatter_, self.late_sigmas_);
  }

 private:
  /// Residual of one motion: x, y [m] and heading [rad] in the axes of its end.
  struct Left {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    Eigen::Matrix3d landmarks = Eigen::Matrix3d::Zero();  ///< Covariance from its two scans.
    Eigen::Matrix3d odometry =
        Eigen::Matrix3d::Zero();  ///< Covariance from odometry, common to overlapping motions.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.value, self.landmarks, self.odometry);
    }
  };
  Left mean() const;

  std::array<Left, kScans> motions_{};  ///< Ring buffer.
  std::size_t count_ = 0;               ///< Motions since the start of the mean.
  double scatter_ = 1.0;                ///< Mean square of the jump in stated sigmas.
  double late_sigmas_ = 0.0;
};

}  // namespace understory::keyframer::joint
