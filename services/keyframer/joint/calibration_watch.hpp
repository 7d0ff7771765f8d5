// Whether odometry and landmarks agree on how the vehicle moves.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "common/model/detection_noise.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/keyframer/keyframer_method.hpp"

namespace understory::keyframer::joint {

/// Compares the motion between scans by landmarks alone with that by wheels.
///
/// A sensor that is mounted at another yaw than configured (by psi) and at another place (by e)
/// sees the motion T of the vehicle as E T E^-1, E = (e, psi). Wheels of another size measure a
/// longer or shorter way (by the share s). To first order the translations differ by
///   t_landmarks - t_wheels = psi J t + (I - R) e - s t,
/// a linear model of four numbers, estimated by least squares over the last minutes and over the
/// last seconds. Where the way does not show one of them, its sigma stays large and it is not
/// named. Turns differ by the gyro's bias, which is taken out, and by what shakes a scan. Odometry
/// without wheels is compared by its turn alone: its velocity comes from landmarks.
class CalibrationWatch {
 public:
  /// Takes odometry as it comes, which no landmark has corrected.
  void add(const model::Odometry& increment);
  /// Whether a motion that ends now overlaps with the last one by no more than half.
  bool is_due(model::Utime now) const { return now >= due_utime_; }
  /// Takes the motion between two scans by landmarks alone.
  void add(const model::ScanMotion& motion);
  /// Takes the motion by landmarks alone since the scan before the last one, or that there is none.
  void check(const std::optional<model::ScanMotion>& step);

  /// Takes that no motion explains what two scans in a row observed.
  void break_off() { contradicts_ = true; }

  /// What differs by the last two minutes; zeros with large sigmas at the start. Cost: one 4 x 4
  /// inverse.
  CalibrationError error() const { return minutes_.error(); }
  /// The same by the last ten seconds.
  CalibrationError lately() const { return seconds_.error(); }

  /// Whether the last step is off by far more than both covariances allow, or nothing explains it:
  /// a jump of the landmarks' frame or its clock, or wheels that slip.
  bool contradicts() const { return contradicts_; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.odometry_, self.wheels_since_, self.due_utime_, self.minutes_, self.seconds_,
      self.contradicts_);
  }

 private:
  /// Both motions between the same two scans.
  struct Both {
    geometry::SE2WithCovariance by_landmarks;
    geometry::SE2WithCovariance by_odometry;
    double seconds = 0.0;
    bool has_wheels = false;
  };

  /// Sums over a time; what is older counts less and less.
  class Memory {
   public:
    explicit Memory(double memory_s) : memory_s_(memory_s) {}
    /// chi^2 of 2 degrees of freedom: the two ways, by what is known of the sensor and the wheels.
    double contradiction(const Both& both) const;
    void compare_turns(const Both& both);
    void compare_ways(const Both& both);
    CalibrationError error() const;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& self) {
      a(self.information_, self.gradient_, self.turn_chi2_, self.turns_, self.turned_rad_,
        self.turned_s_);
    }

   private:
    double memory_s_;
    Eigen::Matrix4d information_ = Eigen::Matrix4d::Zero();  ///< Of (psi, e, s).
    Eigen::Vector4d gradient_ = Eigen::Vector4d::Zero();
    double turn_chi2_ = 0.0;
    double turns_ = 0.0;       ///< Number of turns in the sum.
    double turned_rad_ = 0.0;  ///< Difference of the turns: the gyro's bias times turned_s_.
    double turned_s_ = 0.0;
  };

  std::optional<Both> both_of(const model::ScanMotion& motion) const;

  model::OdometryBuffer odometry_;
  model::Utime wheels_since_ = 0;  ///< Since then each increment has wheels.
  model::Utime due_utime_ = 0;     ///< Motions that end before it overlap too much.
  Memory minutes_{120.0};
  Memory seconds_{10.0};
  bool contradicts_ = false;
};

}  // namespace understory::keyframer::joint
