// Which stem a landmark of the map is.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/model/map.hpp"

namespace understory::eval::experiments::existence::census {

/// Counts, drive after drive, of which stems the detections of each landmark were.
class LandmarkStems {
 public:
  /// The stems of the detections of a scan, until its keyframe is counted.
  void add(model::Utime utime, std::vector<std::uint32_t> stems);
  /// SLAM_UPDATE: its detections, and which landmarks are one.
  void count(const model::MapUpdate& update);
  /// The stem of most detections; none for a landmark without any.
  std::optional<std::uint32_t> of(model::LandmarkId id) const;
  /// Another drive: scans of the one before are forgotten.
  void begin_drive() { scans_.clear(); }

 private:
  std::map<model::Utime, std::vector<std::uint32_t>> scans_;
  std::map<model::LandmarkId, std::map<std::uint32_t, int>> counts_;
};

}  // namespace understory::eval::experiments::existence::census
