// A loop closed in a map as it was read from its file.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/map_closure/finding.hpp"
#include "common/map_file/map_file.hpp"

namespace understory::cli {

/// What is read of a file for it.
struct MapToClose {
  map_file::StoredMap map;
  std::vector<map_file::MapSummary> known;   ///< All maps of the file, to see whether they change.
  std::vector<model::LoopClosure> closures;  ///< That the map has.
  map_closure::PartGraph graph;
};
/// `map_id` 0: the only one that has submaps. Throws MapFileError and map_closure::ClosureError;
/// ends the command where it is not clear which map is meant.
MapToClose read_map_to_close(const std::string& file, std::uint32_t map_id);

/// What a person says.
struct SaidClosure {
  model::LoopEnd from;
  model::LoopEnd to;
  std::string from_text;  ///< As it was said, for errors.
  std::string to_text;
  std::optional<geometry::SE2WithCovariance> from_T_to;  ///< None: it is to be found.
};

/// A closure, and what the map is with it.
struct MadeClosure {
  model::LoopClosure closure;
  std::optional<map_closure::FoundClosure> found;  ///< Where no pose was said.
  geometry::SE2 before;                            ///< from_T_to as the map had it.
  map_closure::Expectation expected;
  map_closure::ClosedGraph closed;
  map_file::StoredMap map;
  map_closure::Shifts shifts;
  std::size_t doubles_before = 0;
  std::size_t doubles = 0;

  /// Where the file's submaps are now, and the closure.
  map_file::Placement placement(const MapToClose& read) const;
};
/// Landmarks of two passes this near to each other are told as doubles [m].
inline constexpr double kCoincident_m = 0.3;

/// Throws map_closure::ClosureError where there is no such end, where the pose is not proven, and
/// unless `force` says that it counts all the same where it contradicts the map beyond chance or
/// the map has a closure of the same two ends: the same landmarks would count again.
MadeClosure make_closure(const MapToClose& read, const SaidClosure& said, bool force,
                         const std::function<void(double)>& progress);

}  // namespace understory::cli
