// The maps built by a mapper in a log.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "common/io/lcm_log.hpp"
#include "common/map_file/stored_existence.hpp"
#include "common/model/held_map.hpp"

namespace understory::cli {

/// Reads MAP, MAP_DELTA, SLAM_UPDATE and EXISTENCE_STATE of a log in which a mapper may begin
/// further maps, and returns the last state of each. A provisional map replaced by another one is
/// dropped, as in the mapper.
class LogMaps {
 public:
  /// One map, and the number of its changes missing in the log.
  struct Found {
    model::WholeMap map;
    std::uint64_t missed = 0;
    /// The last EXISTENCE_STATE of each of its landmarks, from messages of any map, because a map
    /// may have been merged into this one. None where no landmark has a state.
    std::optional<map_file::StoredExistence> existence;
  };

  /// Takes one event; unused channels are skipped.
  void add(const io::LogEvent& event);
  /// All maps by their number, after reading the log. A map merged into a later one is not
  /// included: its landmarks are in the later one, with their ids.
  std::map<std::uint32_t, Found> take();

 private:
  void go_to(std::uint32_t map_id);
  void keep();
  void on_map(const model::WholeMap& whole);
  void on_delta(const model::MapDelta& delta);
  void on_update(const model::MapUpdate& update);

  std::uint32_t map_id_ = 0;  ///< Number of the present map; 0 = none yet.
  bool is_provisional_ = false;
  model::HeldMap held_;
  std::map<std::uint32_t, Found> left_;
  map_file::NewestExistence existence_;  ///< States of all maps.
};

}  // namespace understory::cli
