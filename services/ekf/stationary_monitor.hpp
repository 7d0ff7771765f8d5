// Detects a stationary vehicle, and holds the estimate while it is.
#pragma once

#include <optional>
#include <span>

#include "common/model/odometry.hpp"
#include "services/ekf/compatible_update.hpp"
#include "services/ekf/gates.hpp"
#include "services/ekf/ground_marks.hpp"
#include "services/ekf/parameters.hpp"

namespace understory::ekf {

/// Owner of the doubt in odometry's `is_stationary`. While the vehicle is taken to be stationary,
/// marks on the ground are landmarks of the state (ground_marks.hpp).
///
/// Without wheels `is_stationary` is inferred from quiet IMU samples, which also occur on a smooth
/// road. So it is ignored if it contradicts the filter's own velocity; once proved wrong, it is
/// ignored until the vehicle is reported to move. After 10 s without motion of any landmark the
/// filter must be wrong instead.
class StationaryMonitor {
 public:
  /// Copies the parameters it needs.
  StationaryMonitor(const EkfParameters& parameters, const StationaryGates& gates);

  /// Whether the vehicle is stationary during `increment`, which begins at `now`. Sets the ground
  /// marks, or removes them (leave_place()). `distance_m`: driven so far.
  bool is_stationary(const model::Odometry& increment, model::Utime now, double distance_m,
                     FilterState& state);
  /// Measures that the velocity is zero and that the vehicle is at its marks; sets new marks if it
  /// is not (a slammed door). Precondition: the state has ground marks.
  void hold(FilterState& state, UpdateScratch& scratch) const;
  /// Whether the landmarks `known` of a scan show motion of a vehicle with ground marks: all are
  /// displaced alike, or most are outside of `landmark_gate`.
  bool is_creeping(const FilterState& state, std::span<const Observation> observations,
                   std::span<const Pairing> known, double landmark_gate) const;
  /// `is_stationary` was proved wrong at `now`: it is ignored from now on, and the marks are
  /// removed.
  void doubt(model::Utime now, double distance_m, FilterState& state);
  /// Landmarks of a scan at `now` updated the state: the doubt continues.
  void confirm_motion(model::Utime now, std::uint32_t landmarks_used);
  /// Ends the doubt (after a restart).
  void reset() { doubted_.reset(); }
  /// Whether `is_stationary` is ignored.
  bool is_doubted() const { return doubted_.has_value(); }

  /// Members of a saved state; see common/state. The rest is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.doubted_);
  }

 private:
  bool believes(const model::Odometry& increment, model::Utime now, double distance_m,
                FilterState& state);
  void leave_place(double distance_m, FilterState& state) const;

  StationaryGates gates_;
  Sway sway_;
  double velocity_sigma_mps_ = 0.0;        ///< Of a stationary vehicle.
  double prior_velocity_sigma_mps_ = 0.0;  ///< Of a vehicle with unknown velocity.
  double correlated_share_ = 0.0;          ///< Of an observation's variance.
  std::optional<model::Utime> doubted_;    ///< Time of the last detected motion.
};

}  // namespace understory::ekf
