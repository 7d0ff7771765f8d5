// Motion of the vehicle since the last keyframe, by odometry and by the filter.
#pragma once

#include <optional>

#include "common/model/archive.hpp"
#include "common/model/keyframe.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/geoslam_mapper/parameters.hpp"
#include "services/geoslam_mapper/smoothing/centre_motion.hpp"
#include "services/geoslam_mapper/smoothing/filter_track.hpp"
#include "services/geoslam_mapper/smoothing/placement.hpp"
#include "services/geoslam_mapper/smoothing/stop_bias.hpp"
#include "services/geoslam_mapper/smoothing/trajectory.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The last accepted keyframe's last member, in the frame of its node's centre.
struct LastMember {
  NodeIndex node = 0;
  model::Utime utime = 0;
  geometry::SE2WithCovariance centre_T_vehicle;
  std::optional<model::GyroRotation> rotation;  ///< From the centre to this member, by the gyro.

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& s) {
    a(s.node, s.utime, s.centre_T_vehicle, s.rotation);
  }
};

/// Odometry since the last accepted keyframe, the filter's recent poses, and the pose from which
/// both continue. The gyro's bias is a variable of the graph (GyroBias): a refused keyframe rolls
/// it back with the graph.
class Motion {
 public:
  /// No odometry yet. `parameters` gives `use_odometry`, `gyro_walk`, the noise of predictions
  /// without odometry and `start_heading_sigma_rad`.
  explicit Motion(const SmoothingMapperParameters& parameters);

  /// The same odometry and filter before any keyframe, for a new map.
  Motion from_nowhere() const;

  /// Adds an odometry increment, if the configuration uses odometry.
  void add(const model::Odometry& increment);
  /// Adds the filter's pose as a gate. Without wheels, odometry uses its velocity.
  void add(const model::EkfPose& pose);

  /// Predicted pose of the keyframe's centre: by odometry from the last accepted keyframe, else by
  /// the keyframer's track from the last one. None if neither covers the time since then.
  std::optional<Prediction> predict(const model::Keyframe& keyframe, const PoseGraph& graph) const;
  /// Odometry from the last accepted keyframe's centre to this one's; none if odometry has a gap.
  std::optional<CentreMotion> since_last_centre(const model::Keyframe& keyframe) const;
  /// Odometry between two times (right perturbation); none without odometry or with a gap.
  std::optional<geometry::SE2WithCovariance> between(model::Utime from, model::Utime to) const;
  /// Likewise by the IMU alone; none also if a time is not the end of an increment.
  std::optional<model::InertialMotion> inertial(model::Utime from, model::Utime to) const;
  /// Whether an IMU gives the keyframe's heading to within `start_heading_sigma_rad` at both ends;
  /// true also without an IMU.
  bool knows_heading(const model::Keyframe& keyframe) const;

  /// After an accepted keyframe with its base: odometry continues from its last member.
  void continue_from(const model::Keyframe& keyframe, const Base& base,
                     const geometry::SE2WithCovariance& map_T_base);
  /// After a keyframe that was not localised: its prediction is the start of the next one's.
  void assume(const model::Keyframe& keyframe, const Prediction& prediction);

  /// The last accepted keyframe's last member in the frame of its node; none before the first.
  std::optional<geometry::SE2WithCovariance> centre_T_last_member() const;
  /// The last keyframe's base, accepted or assumed; none before the first.
  const std::optional<geometry::SE2WithCovariance>& map_T_last_base() const {
    return map_T_last_base_;
  }
  /// Recent poses of the filter.
  const FilterTrack& filter() const { return filter_; }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.odometry_, self.stops_, self.filter_, self.last_member_, self.map_T_last_base_);
  }

 private:
  std::optional<model::GyroRotation> rotation_to_centre(const model::Keyframe& keyframe) const;
  std::optional<model::GyroRotation> rotation_since_last_centre(
      const model::Keyframe& keyframe) const;

  SmoothingMapperParameters parameters_;
  model::OdometryBuffer odometry_;
  StopBias stops_;  ///< Since the last motion of the graph.
  FilterTrack filter_;
  std::optional<LastMember> last_member_;
  std::optional<geometry::SE2WithCovariance> map_T_last_base_;
};

}  // namespace understory::geoslam_mapper::smoothing
