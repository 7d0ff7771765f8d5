// Consistency of odometry and landmarks about the vehicle's motion.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <span>

#include "common/model/detection_noise.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/keyframer/joint/jump_watch.hpp"
#include "services/keyframer/joint/motion_difference.hpp"
#include "services/keyframer/reports.hpp"

namespace understory::keyframer::joint {

/// Compares the motion between scans by landmarks alone with that by wheels and gyro.
///
/// A sensor mounted with a yaw error psi and a position error e measures the motion T = (R, t) of
/// the vehicle as E T E^-1, E = (e, psi). Wheels of another size measure a longer or shorter path
/// (by the share s). Scans stamped late by tau measure Exp(tau xi_a) T Exp(-tau xi_b), with the
/// twists xi = (v, w) at the two stamps. To first order
///   t_landmarks - t_wheels = psi J t + (I - R) e - s t + tau (v_a + w_a J t - R v_b),
///   turn_landmarks - turn_gyro = tau (w_a - w_b) - b seconds,
/// where b is the gyro's bias: a linear model of six numbers, estimated by least squares over the
/// last minutes and over the last seconds. If the path does not determine one of them, its sigma
/// stays large and it is not reported. Odometry without wheels is compared only by its rotation:
/// its velocity comes from landmarks.
class CalibrationWatch {
 public:
  /// Adds uncorrected odometry.
  void add(const model::Odometry& increment);
  /// Adds the motion between two scans by landmarks alone. Motions may overlap: their rotations are
  /// all compared; their translations only if they overlap the last one by at most half, since the
  /// error of wheels grows with the path.
  void add(const model::ScanMotion& motion);
  /// Adds the motion over the last JumpWatch::kScans scans, or none.
  void watch(model::Utime now, const std::optional<model::ScanMotion>& motion);
  /// Adds the motion by landmarks alone since the scan before the last one, or none.
  void check(const std::optional<model::ScanMotion>& step);

  /// Records that no motion fits the observations of two successive scans.
  void break_off() { contradicts_ = true; }

  /// The errors by the last two minutes; zeros with large sigmas at the start. Cost: one 6 x 6
  /// inverse.
  CalibrationError error() const { return minutes_.error(); }
  /// The same by the last ten seconds.
  CalibrationError lately() const { return seconds_.error(); }

  /// Whether the last step differs by far more than both covariances allow, or no motion fits it,
  /// or the clock appears to have jumped within the last ten seconds: a jump of the landmarks'
  /// frame or its clock, or slipping wheels.
  bool contradicts() const { return contradicts_ || has_jumped_; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.odometry_, self.waiting_, self.wheels_since_, self.due_utime_, self.last_utime_,
      self.last_start_utime_, self.minutes_, self.seconds_, self.jump_, self.contradicts_,
      self.jumped_utime_, self.has_jumped_, self.has_inertial_, self.has_wheels_,
      self.other_increments_);
  }

 private:
  /// Sums with exponential forgetting.
  class Memory {
   public:
    explicit Memory(double memory_s) : memory_s_(memory_s) {}
    /// chi^2 of 2 degrees of freedom: difference of the two translations, given the estimates for
    /// sensor and wheels.
    double contradiction(const TwoMotions& motions) const;
    /// Of two successive scans.
    void compare_steps(const TwoMotions& motions);
    /// `overlapping`: number of successive motions that share each part of odometry.
    void compare_turns(const TwoMotions& motions, double overlapping);
    void compare_ways(const TwoMotions& motions);
    /// Reduces the weight of the sums by the time passed.
    void forget(double passed_s);
    CalibrationError error() const;
    CalibrationMatrix covariance() const;
    /// Estimate with only these numbers free, and the decrease of chi^2.
    struct Account {
      CalibrationNumbers numbers = CalibrationNumbers::Zero();
      double chi2 = 0.0;
    };
    Account account(std::span<const int> free) const;
    const CalibrationNumbers& gradient() const { return gradient_; }

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.information_, self.gradient_, self.turn_chi2_, self.turns_, self.turned_rad_,
        self.turned_s_, self.moved_m2ps_, self.moved_rad2ps_);
    }

   private:
    double memory_s_;
    CalibrationMatrix information_ = CalibrationMatrix::Zero();
    CalibrationNumbers gradient_ = CalibrationNumbers::Zero();
    double turn_chi2_ = 0.0;
    double turns_ = 0.0;       ///< Number of steps in the sum.
    double turned_rad_ = 0.0;  ///< Difference of the rotations: the gyro's bias times turned_s_.
    double turned_s_ = 0.0;
    double moved_m2ps_ = 0.0;    ///< Squared speed times turned_s_.
    double moved_rad2ps_ = 0.0;  ///< Squared rate times turned_s_.
  };

  std::optional<TwoMotions> two_motions(const model::ScanMotion& motion) const;
  std::optional<Eigen::Vector3d> twist_over(model::Utime from, model::Utime to) const;
  void compare(const model::ScanMotion& motion);
  void note_sensors(const model::Odometry& increment);

  model::OdometryBuffer odometry_;
  std::deque<model::ScanMotion> waiting_;  ///< Wait for the odometry after them.
  model::Utime wheels_since_ = 0;          ///< Since then every increment has wheels.
  model::Utime due_utime_ = 0;             ///< Motions that end earlier overlap too much.
  model::Utime last_utime_ = 0;            ///< End of the last motion.
  model::Utime last_start_utime_ = 0;
  static constexpr double kMinutes_s = 120.0;
  static constexpr double kSeconds_s = 10.0;
  Memory minutes_{kMinutes_s};
  Memory seconds_{kSeconds_s};
  JumpWatch jump_;
  bool contradicts_ = false;
  std::optional<model::Utime> jumped_utime_;
  bool has_jumped_ = false;
  bool has_inertial_ = true;  ///< In the compared increments.
  bool has_wheels_ = true;
  int other_increments_ = 0;  ///< Successive ones that differ from has_inertial_.
};

}  // namespace understory::keyframer::joint
