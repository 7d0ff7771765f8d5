// Errors that detections of several scans share: of one landmark along the path and by direction,
// errors that grow with range, and errors of all landmarks of a scan.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/geometry/se2.hpp"
#include "common/model/level.hpp"

namespace understory::sim {

/// Shared errors of detections. Every part is off by default. The independent share of a
/// detection's noise is the simulator's own `position_sigma_m`. Sigmas are standard deviations.
struct SharedErrorParameters {
  /// Of a landmark per axis [m]: a stationary process of the travelled distance d, Gaussian at each
  /// point, with correlation 1 - d / along_length_m, and 0 beyond this length: as of overlapping
  /// clouds. Another drive, or a later pass in the same, has other errors.
  double along_sigma_m = 0.0;
  double along_length_m = 10.0;
  /// Of a landmark per axis [m]: a periodic Gaussian process of the direction of view, the same on
  /// a later pass and in another drive through the same forest. A trunk is not round, and its lean
  /// matters at the height of the detection.
  double direction_sigma_m = 0.0;
  /// The correlation at an angle a is the mean of cos(k a), k = 1 to this: 4 give 0.5 at 0.4 rad.
  int direction_harmonics = 4;
  /// Error of the range as a share of the range; < 0: landmarks are detected too near.
  double radial_bias_share = 0.0;
  /// Error of the bearing [rad]: this times the sine of the bearing in the vehicle, as with an
  /// eccentric encoder. The tangential error is that times the range.
  double bearing_bias_rad = 0.0;
  /// Error of roll and of pitch [rad] after levelling, correlated along the path like that of a
  /// landmark; it displaces all detections of a scan alike, by `level_height_m` times the error.
  double level_sigma_rad = 0.0;
  double level_length_m = 20.0;
  double level_height_m = model::kLandmarkHeight_m;
  /// Of the landmarks: never detected in this drive. Other drives miss others.
  double missed_share = 0.0;

  /// Whether any part is on.
  bool any() const;
};

/// As measured for stems on a recorded walk (frames 2 m apart, ranges to 35 m): standard deviation
/// 0.055 m per axis, of which 0.01 m are independent; correlation after 1, 2, 3 frames 0.75, 0.5,
/// 0.3; a fifth of the variance repeats from the same direction hours later; 0.6 mm too near per
/// metre of range.
SharedErrorParameters measured_shared_errors();
/// The corresponding independent standard deviation per axis [m].
inline constexpr double kMeasuredIndependentSigmaM = 0.01;
/// Standard deviation per axis of both together, without the bias of ranges [m]: 0.054.
double measured_sigma_m();

/// The errors of one drive. Every value follows from the seeds and the arguments alone, independent
/// of earlier calls. A call costs about 5 us if the path's part is on.
class SharedErrors {
 public:
  /// `forest_seed`: of the part by direction, common to drives through one forest; `drive_seed`: of
  /// all others. Throws std::invalid_argument for a negative sigma, a length that is not positive,
  /// or less than one harmonic if that part is on.
  SharedErrors(const SharedErrorParameters& parameters, std::uint64_t forest_seed,
               std::uint64_t drive_seed);

  /// Whether the drive never detects the landmark.
  bool is_missed(std::uint32_t landmark) const;
  /// Error of a detection [m], frame `vehicle_level`: to be added to its true position there.
  /// `along_m`: distance travelled up to the scan.
  Eigen::Vector2d error_m(std::uint32_t landmark, const Eigen::Vector2d& position_m,
                          const geometry::SE2& world_T_vehicle, double along_m) const;
  /// The error common to all detections of a scan [m], frame `vehicle_level`; contained in
  /// error_m().
  Eigen::Vector2d level_error_m(double along_m) const;

  /// The parameters in use.
  const SharedErrorParameters& parameters() const { return parameters_; }

 private:
  Eigen::Vector2d by_direction(std::uint32_t landmark, double direction_rad) const;
  Eigen::Vector2d by_range_and_bearing(const Eigen::Vector2d& position_m) const;

  SharedErrorParameters parameters_;
  std::uint64_t shapes_key_ = 0;
  std::uint64_t drive_key_ = 0;
};

}  // namespace understory::sim
