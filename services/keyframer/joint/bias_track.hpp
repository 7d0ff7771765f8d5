// The IMU's bias as it is known from keyframe to keyframe.
#pragma once

#include <optional>

#include "services/keyframer/joint/inertial_chain.hpp"

namespace understory::keyframer::joint {

/// Owns the estimate. Each keyframe teaches it; in between it walks. A keyframe uses what the ones
/// before it have taught: from its own scans alone, a bias and a curve of the way look alike.
class BiasTrack {
 public:
  /// As known now. Before the first estimate: the bias that `step` took out, the gyro's as sure as
  /// the rotation `motion` states, the accelerometer's as of any sensor.
  BiasEstimate known(const model::InertialMotion& step,
                     const geometry::SE2WithCovariance& motion) const;
  /// A keyframe's estimate.
  void learn(const BiasEstimate& estimate) { estimate_ = estimate; }
  /// Time passes: the bias walks, and the level's new error is one of the accelerometer's bias.
  void pass(const model::InertialMotion& step);
  /// Nothing is known any more.
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
