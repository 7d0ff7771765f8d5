// The filter's outputs, and the last valid pose.
#pragma once

#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/level.hpp"
#include "services/ekf/filter_state.hpp"
#include "services/ekf/parameters.hpp"
#include "services/ekf/scan_update.hpp"
#include "services/ekf/vehicle_motion.hpp"

namespace understory::ekf {

/// Fit of a scan, for HEALTH; see ScanUpdate.
struct ScanFit {
  std::uint32_t observed = 0;  ///< Usable observations.
  std::uint32_t used = 0;      ///< Observations that updated the state.
  double nis = 0.0;
  int nis_degrees = 0;
};

/// The filter's outputs for one message; each part but the last has a channel of its own.
struct EkfOutput {
  std::optional<model::EkfPose> pose;
  std::optional<model::EkfMap> map;
  std::optional<model::VelocityCorrection> correction;
  std::optional<model::EkfLevel> level;  ///< With each pose, if sweeps are levelled.
  std::optional<ScanFit> scan;           ///< With a scan.
  bool is_late = false;  ///< A pose of a later time was given already: not to be published.
};

/// The pose at which the filter restarts when its state is unusable.
struct SoundPose {
  geometry::SE2 ekf_map_T_vehicle;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< Right perturbation.
  model::InertialBias bias = model::InertialBias::Zero();

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.ekf_map_T_vehicle, self.covariance, self.bias);
  }
};

/// Builds outputs from the state; the bus adds sequence numbers. Owner of the number of restarts,
/// and of the last pose given.
///
/// The state's heading is that of the frame to which sweeps and odometry are levelled. A roll error
/// rotates that frame by its product with the tangent of the pitch, differently on each slope; the
/// published heading is without that rotation. A scale error common to all distances
/// (`scale_sigma`) scales the whole map about its origin. No observation measures it, so it is
/// added to the published covariances and not to the state's; likewise the common error of sweeps
/// that no IMU has levelled.
class EkfReport {
 public:
  explicit EkfReport(const EkfObservationParameters& parameters)
      : scale_sigma_(parameters.scale_sigma) {}

  /// Adds an increment: it tells whether sweeps are levelled.
  void add(const model::Odometry& odometry) { sweep_level_.add(odometry); }
  /// The pose at `now`, with the level if odometry reports one. `update`: the scan that it follows;
  /// empty after odometry alone.
  EkfOutput pose(const FilterState& state, const VehicleMotion& motion, model::Utime now,
                 const ScanUpdate& update);
  /// Pose, map and velocity correction at `now`, with the level if odometry reports one.
  EkfOutput all(const FilterState& state, const VehicleMotion& motion, model::Utime now,
                const ScanUpdate& update);

  /// The map begins: `state` is the first valid pose.
  void begin(const FilterState& state, const VehicleMotion& motion);
  /// Counts a restart, published as EkfPose::reset_counter.
  void count_restart() { ++reset_counter_; }
  /// The last pose given out.
  const SoundPose& last_sound() const { return last_sound_; }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.reset_counter_, self.last_sound_, self.sweep_level_);
  }

 private:
  model::EkfMap map(const FilterState& state, model::Utime now);

  double scale_sigma_;
  std::uint64_t reset_counter_ = 0;
  SoundPose last_sound_;
  model::SweepLevel sweep_level_;
};

}  // namespace understory::ekf
