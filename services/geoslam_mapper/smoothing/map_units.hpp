// Conversion from units of the map to metres; see RangeScale.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "common/model/map.hpp"
#include "common/model/submap.hpp"
#include "services/geoslam_mapper/mapper_output.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The factor by which the map is scaled for output. It follows the estimate in steps: each step
/// moves every landmark, so subscribers get the whole map anew.
class MapUnits {
 public:
  /// Updates the factor from the present estimate.
  void follow(double map_factor);
  /// Metres per unit of the map.
  double factor() const { return factor_; }
  /// Whether there was a step since the last call.
  bool take_step() { return std::exchange(stepped_, false); }

  /// Converts translations to metres. Covariances are not scaled: the change is smaller than their
  /// own accuracy.
  geometry::SE2 metres(const geometry::SE2& pose) const;
  model::MapUpdate metres(model::MapUpdate update) const;
  ScanPose metres(ScanPose pose) const;
  std::vector<model::MapLandmark> metres(std::vector<model::MapLandmark> landmarks) const;
  std::vector<model::KeyframePose> metres(std::vector<model::KeyframePose> poses) const;
  std::vector<model::SubmapPose> metres(std::vector<model::SubmapPose> poses) const;
  /// Likewise, except for the payload, which only the mapper reads.
  std::vector<model::Submap> metres(std::vector<model::Submap> submaps) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.factor_, self.stepped_);
  }

 private:
  double factor_ = 1.0;
  bool stepped_ = false;
};

}  // namespace understory::geoslam_mapper::smoothing
