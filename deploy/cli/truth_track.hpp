// The true poses of a recorded run over time.
#pragma once

#include <map>
#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/landmarks.hpp"

namespace understory::cli {

/// The poses of GROUND_TRUTH, frame world.
class TruthTrack {
 public:
  /// Adds a pose; it replaces an earlier one of the same time.
  void add(model::Utime utime, const geometry::SE2& world_T_vehicle) {
    poses_.insert_or_assign(utime, world_T_vehicle);
  }
  /// The true pose at `utime`, interpolated between two poses at most 0.2 s apart; none elsewhere.
  /// O(log n).
  std::optional<geometry::SE2> at(model::Utime utime) const;

 private:
  std::map<model::Utime, geometry::SE2> poses_;
};

}  // namespace understory::cli
