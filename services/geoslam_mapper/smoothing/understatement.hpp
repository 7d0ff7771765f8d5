// Factor by which the graph understates its variances, along the path.
#pragma once

#include <map>

namespace understory::geoslam_mapper::smoothing {

/// Factor by which variances were raised, for each path length [m]; 1 elsewhere. Piecewise
/// constant.
class Understatement {
 public:
  /// The factor at a path length.
  double at(double along_m) const;
  /// The smallest factor on a stretch.
  double least(double from_m, double to_m) const;
  /// Raises the factor on a stretch to `factor` if it is smaller. Cost: the steps on it.
  void raise(double from_m, double to_m, double factor);

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.steps_);
  }

 private:
  std::map<double, double> steps_;  ///< From this path length on [m]: the factor.
};

}  // namespace understory::geoslam_mapper::smoothing
