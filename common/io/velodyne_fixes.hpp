// Fixes of the GNSS receiver at a Velodyne laser, from its position packets.
#pragma once

#include <optional>
#include <span>

#include "common/io/oxts.hpp"
#include "common/io/velodyne.hpp"
#include "common/model/gnss.hpp"

namespace understory::io {

/// Input: position packets; output: fixes, both live and from captures.
class VelodyneFixes {
 public:
  /// `origin` of metres east and north; none = the first fix.
  explicit VelodyneFixes(std::optional<LocalPlane> plane = {}) : plane_(plane) {}

  /// `received`: reception time of the packet [us], which is the fix's stamp. None where the
  /// sentence is marked as invalid or repeats the last one: the receiver sends one per second, the
  /// sensor repeats it.
  std::optional<model::GnssFix> add(const VelodynePosition& position, model::Utime received);

 private:
  std::optional<LocalPlane> plane_;
  std::optional<std::int64_t> last_day_us_;
};

}  // namespace understory::io
