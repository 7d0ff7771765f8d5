// Fixes of the GNSS receiver at a Velodyne laser, from its position packets.
#pragma once

#include <optional>
#include <span>

#include "common/io/oxts.hpp"
#include "common/io/velodyne.hpp"
#include "common/model/gnss.hpp"

namespace understory::io {

/// Position packets in, fixes out: live and from captures alike.
class VelodyneFixes {
 public:
  /// From where metres east and north count; none = the first fix.
  explicit VelodyneFixes(std::optional<LocalPlane> plane = {}) : plane_(plane) {}

  /// `received`: when the packet came [us]; the fix's stamp. None where the sentence is
  /// marked as not valid or repeats the last one: the receiver gives one a second, the sensor
  /// repeats it.
  std::optional<model::GnssFix> add(const VelodynePosition& position, model::Utime received);

 private:
  std::optional<LocalPlane> plane_;
  std::optional<std::int64_t> last_day_us_;
};

}  // namespace understory::io
