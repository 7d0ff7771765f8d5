// Detections at the true level.
#pragma once

#include <optional>

#include "common/model/ekf_output.hpp"
#include "common/model/landmarks.hpp"

namespace understory::model {

/// The filter's latest word on the level, for those who take LANDMARKS.
class LevelCorrection {
 public:
  void set(const EkfLevel& level) { level_ = level; }
  /// The scan as it is at the true level: an error of roll and pitch displaces detections by their
  /// height. The covariance that this error had in theirs is replaced by what is left of it. As it
  /// came where the filter said nothing lately.
  LandmarkScan levelled(LandmarkScan scan) const;
  const std::optional<EkfLevel>& latest() const { return level_; }
  void restore(const std::optional<EkfLevel>& level) { level_ = level; }
  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.level_);
  }

 private:
  std::optional<EkfLevel> level_;
};

/// A detection's covariance in the plan without the part that an error of the level has in it, as
/// far as there is something left. `arm`: displacement by (roll, pitch).
Eigen::Matrix2d without_level(const Eigen::Matrix2d& covariance_m2, const Eigen::Matrix2d& arm,
                              const Eigen::Matrix2d& level_covariance_rad2);

}  // namespace understory::model
