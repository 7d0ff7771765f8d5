// By how much the graph understates its variances, along the path.
#pragma once

#include <map>

namespace understory::geoslam_mapper::smoothing {

/// Factor by which variances were raised, for each point of the vehicle's path [m]; 1 where the
/// graph is believed. Piecewise constant.
class Understatement {
 public:
  /// The factor at a point of the path.
  double at(double along_m) const;
  /// The smallest factor on a stretch.
  double least(double from_m, double to_m) const;
  /// Raises the factor on a stretch to `factor`, where it is smaller. Cost: the steps on it.
  void raise(double from_m, double to_m, double factor);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.steps_);
  }

 private:
  std::map<double, double> steps_;  ///< From a point of the path on [m]: the factor.
};

}  // namespace understory::geoslam_mapper::smoothing
