// The IMU's bias from keyframe to keyframe.
#pragma once

#include <optional>

#include "services/keyframer/joint/inertial_chain.hpp"

namespace understory::keyframer::joint {

/// Owns the estimate. Each keyframe updates it; in between it is a random walk. A keyframe uses the
/// estimate of earlier ones: from its own scans alone, a bias and a curved path cannot be
/// distinguished.
class BiasTrack {
 public:
  /// The present estimate. Before the first one: the bias that `step` was corrected by; the gyro's
  /// with the uncertainty of the rotation of `motion`, the accelerometer's with that of any sensor.
  BiasEstimate known(const model::InertialMotion& step,
                     const geometry::SE2WithCovariance& motion) const;
  /// Sets a keyframe's estimate.
  void learn(const BiasEstimate& estimate) { estimate_ = estimate; }
  /// Propagates over a step: the bias walks, and the change of the level's error acts as one of the
  /// accelerometer's bias.
  void pass(const model::InertialMotion& step);
  /// Clears the estimate.
  void forget() { estimate_.reset(); }

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.estimate_);
  }

 private:
  std::optional<BiasEstimate> estimate_;
};

}  // namespace understory::keyframer::joint
