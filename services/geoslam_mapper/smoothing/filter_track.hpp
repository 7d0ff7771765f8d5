// Where the filter says that the vehicle went lately: to gate by, never a measurement (the filter
// sees the same detections).
#pragma once

#include <deque>
#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/ekf_output.hpp"

namespace understory::geoslam_mapper::smoothing {

class FilterTrack {
 public:
  /// In order of time; a pose that does not come later than the last is ignored. A restart of the
  /// filter forgets all before it.
  void add(const model::EkfPose& pose);
  /// Motion between two times, where the filter told poses near both.
  std::optional<geometry::SE2> between(model::Utime from, model::Utime to) const;

 private:
  std::optional<geometry::SE2> pose_at(model::Utime utime) const;

  std::deque<model::EkfPose> poses_;
};

}  // namespace understory::geoslam_mapper::smoothing
