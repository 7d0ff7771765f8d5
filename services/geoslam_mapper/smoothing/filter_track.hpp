// Recent poses of the filter.
#pragma once

#include <deque>
#include <optional>

#include "common/geometry/se2.hpp"
#include "common/model/archive.hpp"
#include "common/model/ekf_output.hpp"

namespace understory::geoslam_mapper::smoothing {

/// The filter's poses of the last 10 s. They are used as a gate, never as a measurement: the filter
/// uses the same detections.
class FilterTrack {
 public:
  /// Adds a pose. One that is not later than the last is ignored; a restart of the filter forgets
  /// all poses before it.
  void add(const model::EkfPose& pose);

  /// Motion of the vehicle between two times; none unless the filter has a pose within 60 ms of
  /// both.
  std::optional<geometry::SE2> between(model::Utime from, model::Utime to) const;

  /// Members of a saved state; see common/state.
  template <class Archive, class Self>
  static void archive(Archive& a, Self& self) {
    a(self.poses_);
  }

 private:
  std::optional<geometry::SE2> pose_at(model::Utime utime) const;

  std::deque<model::EkfPose> poses_;
};

}  // namespace understory::geoslam_mapper::smoothing
