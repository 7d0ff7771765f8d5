// The maps that a mapper built in a log.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "common/io/lcm_log.hpp"
#include "common/map_file/stored_existence.hpp"
#include "common/model/held_map.hpp"

namespace understory::cli {

/// Follows MAP, MAP_DELTA, SLAM_UPDATE and EXISTENCE_STATE through a log in which a mapper may
/// begin further maps: each as it was last. A provisional map that gave way to another one is
/// dropped, as the mapper drops it.
class LogMaps {
 public:
  /// One map, and how many of its changes are missing in the log.
  struct Found {
    model::WholeMap map;
    std::uint64_t missed = 0;
    /// The last EXISTENCE_STATE of each of its landmarks, whatever map the message was of: a map
    /// may have become part of this one. None where no landmark has any.
    std::optional<map_file::StoredExistence> existence;
  };

  /// Takes one event; channels that do not matter are passed over.
  void add(const io::LogEvent& event);
  /// All maps by their number, once the log is read. A map that became part of a later one is not
  /// among them: its landmarks are in the later one, with their ids.
  std::map<std::uint32_t, Found> take();

 private:
  void go_to(std::uint32_t map_id);
  void keep();
  void on_map(const model::WholeMap& whole);
  void on_delta(const model::MapDelta& delta);
  void on_update(const model::MapUpdate& update);

  std::uint32_t map_id_ = 0;  ///< Of the map that is held; 0 = none yet.
  bool is_provisional_ = false;
  model::HeldMap held_;
  std::map<std::uint32_t, Found> left_;
  map_file::NewestExistence existence_;  ///< Of all maps.
};

}  // namespace understory::cli
