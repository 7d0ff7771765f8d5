// The gyro's bias as variables of the mapper's graph.
#pragma once

#include <optional>

#include "common/factor_graph/plane/smoother.hpp"
#include "common/model/odometry_buffer.hpp"
#include "common/model/state.hpp"

namespace understory::geoslam_mapper::smoothing {

/// One scalar for some seconds each, tied to the one before by the bias's random walk. They count
/// from the filter's bias when the vehicle first moved, so they are small.
class GyroBias {
 public:
  /// `walk`: [rad/s/sqrt(s)]; 0 = the bias is not estimated.
  explicit GyroBias(double walk) : walk_(walk) {}

  bool is_estimated() const { return walk_ > 0.0; }
  /// A keyframe came from the place of the one before.
  void stood() { was_stationary_ = true; }
  /// Adds the motion with the bias at `utime` as a third variable; its turn is `turn`. `filter`:
  /// what the filter knows of the bias then; it is used once when the vehicle first moves, and what
  /// it learned while the vehicle stood, of which the graph has nothing.
  void add_motion(const factor_graph::plane::RelativePose& motion, const model::GyroRotation& turn,
                  const model::FilterBias& filter, model::Utime utime,
                  factor_graph::plane::Smoother& smoother);

  model::Json save() const;
  void load(const model::Json& json);

 private:
  void learn_from(const model::FilterBias& filter, model::Utime utime,
                  factor_graph::plane::Smoother& smoother);

  struct Newest {
    factor_graph::plane::ScalarId id{};
    model::Utime since = 0;
  };
  double walk_;
  double reference_ = 0.0;  ///< [rad/s]
  std::optional<Newest> newest_;
  bool was_stationary_ = false;
  /// The filter's word when the vehicle last moved.
  model::FilterBias before_;
  model::Utime before_utime_ = 0;
};

}  // namespace understory::geoslam_mapper::smoothing
