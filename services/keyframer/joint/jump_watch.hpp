// Whether the scans' clock, or the frame of the landmarks, has jumped against odometry just now.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "services/keyframer/joint/motion_difference.hpp"

namespace understory::keyframer::joint {

/// Averages what the calibration leaves of the last motions, in the axes of their ends.
///
/// After a jump all motions that span it differ by the same: a clock that jumps by tau by
/// -tau xi, with the twist xi of the vehicle. Each of them has the noise of two other scans, so
/// landmarks' noise in the mean of n has an n-th of the variance. The motions are short, so that
/// wheels add little. How much the mean scatters without a jump is learned as well, as wheels slip
/// by more than they state.
class JumpWatch {
 public:
  /// Scans that a motion goes over, and motions in the mean: no two share a scan.
  static constexpr std::size_t kScans = 5;

  /// Takes the next motion. `calibration`: what is known before it, and its covariance.
  /// Cost: a few 3 x 3 matrices.
  void add(const TwoMotions& motions, const CalibrationNumbers& calibration,
           const CalibrationMatrix& covariance);
  /// Tracking or odometry has a gap: the mean begins anew.
  void begin_anew() {
    count_ = 0;
    late_sigmas_ = 0.0;
  }

  /// By how many sigmas the clock seems to have jumped; 0 while the first motions come.
  double late_sigmas() const { return late_sigmas_; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.motions_, self.count_, self.scatter_, self.late_sigmas_);
  }

 private:
  /// What one motion leaves: x, y [m] and heading [rad] in the axes of its end.
  struct Left {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    Eigen::Matrix3d landmarks = Eigen::Matrix3d::Zero();  ///< Covariance by its two scans.
    Eigen::Matrix3d odometry = Eigen::Matrix3d::Zero();   ///< The same, which the motions share.

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.value, self.landmarks, self.odometry);
    }
  };
  Left mean() const;

  std::array<Left, kScans> motions_{};  ///< A ring.
  std::size_t count_ = 0;               ///< Of motions since it began.
  double scatter_ = 1.0;                ///< Mean square of late_sigmas(), as stated.
  double late_sigmas_ = 0.0;
};

}  // namespace understory::keyframer::joint
