// Update by the landmarks that are compatible together, with a rollback.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "services/ekf/landmark_update.hpp"
#include "services/ekf/low_rank.hpp"

namespace understory::ekf {

/// A copy of a state's covariance, restored after a failed update. Allocated once.
class CovarianceBackup {
 public:
  /// For states of up to `max_size` rows.
  explicit CovarianceBackup(int max_size)
      : covariance_(Eigen::MatrixXd::Zero(max_size, max_size)) {}

  /// Copies the covariance. O(size^2).
  void take(const FilterState& state) {
    covariance_.topLeftCorner(state.size(), state.size()) = state.covariance();
  }
  /// Rolls the covariance back. Precondition: `state` has as many landmarks as at the time of the
  /// copy.
  void restore(FilterState& state) const {
    state.covariance() = covariance_.topLeftCorner(state.size(), state.size());
  }

 private:
  Eigen::MatrixXd covariance_;
};

/// Memory of the filter's updates, allocated once. Its content is valid during one update only.
struct UpdateScratch {
  /// For states of up to `max_landmarks` landmarks.
  explicit UpdateScratch(int max_landmarks)
      : low_rank(kVehicle + 2 * max_landmarks),
        joint(max_landmarks),
        backup(kVehicle + 2 * max_landmarks) {}

  LowRank low_rank;
  JointUpdate joint;
  CovarianceBackup backup;
};

/// Result of an update.
struct CompatibleUpdate {
  std::uint32_t removed = 0;  ///< Pairings that did not fit the others.
  double distance = 0.0;      ///< Joint squared Mahalanobis distance of the used pairings.
};

/// Updates the state by the `pairings` that together pass the gate for their number: until the rest
/// passes, the worst ones are removed from `pairings` and counted at their landmark. `set_gates`:
/// limit of the squared Mahalanobis distance by number of pairings.
CompatibleUpdate update_compatible(FilterState& state, std::span<const Observation> observations,
                                   std::vector<Pairing>& pairings,
                                   std::span<const double> set_gates, UpdateScratch& scratch);

}  // namespace understory::ekf
