// The gyro's bias as variables of the mapper's graph.
#pragma once

#include <optional>

#include "common/factor_graph/plane/smoother.hpp"
#include "common/model/odometry_buffer.hpp"
#include "services/geoslam_mapper/smoothing/centre_motion.hpp"

namespace understory::geoslam_mapper::smoothing {

/// A chain of scalars, one for 5 s each, tied to the one before by the bias's random walk. They
/// count from the filter's bias at the first motion, so they are small.
class GyroBias {
 public:
  /// `walk`: random walk of the bias [rad/s/sqrt(s)]; 0 = the bias is not estimated.
  explicit GyroBias(double walk) : walk_(walk) {}

  /// Whether the bias is a variable of the graph.
  bool is_estimated() const { return walk_ > 0.0; }

  /// The vehicle was stationary between two keyframes: the filter has learned the bias meanwhile.
  void set_stationary() { was_stationary_ = true; }

  /// Adds the motion between two poses with the bias as a third variable. `measured` holds the two
  /// poses; its motion and information are those of `motion`, which must have `gyro` and
  /// `filter_bias`. The filter's bias is used once at the first motion, and after that only for
  /// what the filter learned while the vehicle was stationary: the graph has nothing of that.
  void add_motion(factor_graph::plane::RelativePose measured, const CentreMotion& motion,
                  factor_graph::plane::Smoother& smoother);

  /// Members of a saved state; see common/state. The walk is configuration.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.reference_, self.newest_, self.was_stationary_, self.before_, self.before_utime_);
  }

 private:
  void learn_from(const model::FilterBias& filter, model::Utime utime,
                  factor_graph::plane::Smoother& smoother);

  struct Newest {
    factor_graph::plane::ScalarId id{};
    model::Utime since = 0;

    template <class Archive, class Self>
    static void archive(Archive& a, Self& s) {
      a(s.id, s.since);
    }
  };
  double walk_;             ///< [rad/s/sqrt(s)]
  double reference_ = 0.0;  ///< From which the scalars count [rad/s].
  std::optional<Newest> newest_;
  bool was_stationary_ = false;
  model::FilterBias before_;  ///< The filter's bias at the last motion.
  model::Utime before_utime_ = 0;
};

}  // namespace understory::geoslam_mapper::smoothing
