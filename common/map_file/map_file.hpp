// A map file: an SQLite database that is also a GeoPackage.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/map_file/history.hpp"
#include "common/map_file/stored_map.hpp"
#include "common/model/map_reference.hpp"
#include "common/model/submap.hpp"

namespace understory::map_file {

/// Summary of one map in a file.
struct MapSummary {
  std::uint32_t map_id = 0;
  std::string name;
  model::Utime created_utime = 0;
  std::string origin;
  std::string
      checksum;  ///< SHA-256 of its content, as stated in the file; equal content has equal sums.
  std::uint64_t trunks = 0;
  std::uint64_t corners = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t submap_borders = 0;
  std::uint64_t loop_closures = 0;
  std::uint64_t existence_states = 0;  ///< Landmarks with a state of existence ...
  std::uint64_t not_in_use = 0;        ///< ... and those of them judged as removed.
};

/// New poses of submaps of one map, and its new closures.
struct Placement {
  std::vector<model::SubmapPose> submaps;
  std::vector<model::LoopClosure> closures;  ///< Each has a new number in the map.
};

/// An open map file. All functions throw MapFileError with the file name.
///
/// Opened for reading it shows one constant state. Opened for writing it is locked for others; each
/// change is one transaction, on the device when the call returns, and recorded with the old rows.
/// If the process is killed, the file has every finished change. After closing it is a single file
/// in SQLite's plain format.
class MapFile {
 public:
  /// Opens an existing file. If a writing process was killed, its last finished change is first
  /// brought into the file, if that is writable. A drive's file (drive_file.hpp) whose store was
  /// killed is sealed first. O(1) except for these cases.
  MapFile(const std::filesystem::path& file, Access access);
  ~MapFile();
  /// The moved-from object is closed.
  MapFile(MapFile&&) noexcept;
  MapFile& operator=(MapFile&&) = delete;

  /// The file given to the constructor.
  const std::filesystem::path& file() const;
  /// All maps, ascending by number. O(size).
  std::vector<MapSummary> maps() const;
  /// Reads one map and compares its checksum (Fault::kDamaged). O(size).
  StoredMap read(std::uint32_t map_id) const;
  /// The submaps of a drive's map at their present poses, in order of id, without those whose
  /// content is in others; empty for a file without submaps. O(size).
  std::vector<model::Submap> submaps(std::uint32_t map_id) const;
  /// Its valid loop closures in order of arrival, without covariances.
  std::vector<model::LoopClosure> closures(std::uint32_t map_id) const;
  /// Location of its maps' frame on the earth; none where unknown.
  std::optional<model::MapReference> reference() const;
  /// All changes, the oldest first.
  std::vector<Change> history() const;
  /// The version of Understory that wrote it last; empty for older versions, which did not state
  /// it.
  std::string program_version() const;
  /// All faults, one per line: pages and indexes of SQLite, tables and rows that a GeoPackage must
  /// have, values, checksums of maps and of changes. O(size).
  std::vector<std::string> check() const;

  /// Writes maps as one change and returns its number; maps of equal number are replaced, others
  /// stay. All or nothing.
  std::uint64_t put(std::span<const StoredMap> maps, const ChangeNote& note);
  /// Writes one map with new poses of its submaps as one change, which revert() undoes as a whole.
  /// Fault::kRefused where a submap is not the map's, or a closure's number is in use.
  std::uint64_t put(const StoredMap& map, const Placement& placement, const ChangeNote& note);
  /// Sets the location of the maps' frame on the earth; coordinates stay. This is a change; returns
  /// its number. O(features).
  std::uint64_t put(const model::MapReference& reference, const ChangeNote& note);
  /// Restores all maps to the state after change `to` (0 = before the first one), as a new change,
  /// which can be reverted too; returns its number. Changes by other programs are recorded before
  /// it. Fault::kRefused where change `to` does not exist. O(all changes).
  std::uint64_t revert(std::uint64_t to, const ChangeNote& note);
  /// Accepts changes of maps by other programs as a recorded change, updates the checksums and
  /// returns its number. Fault::kRefused where there are none, kDamaged where a map became invalid.
  /// O(all changes).
  std::uint64_t accept(const ChangeNote& note);

 private:
  std::unique_ptr<Connection> connection_;
  Access access_;
};

/// Creates a new file with these maps and the location of their frame as its first change,
/// completely or not at all. Links are followed. Fault::kRefused where the name exists already. If
/// the process is killed, at most a file FILE.part-XXXXXX is left.
void create_map_file(const std::filesystem::path& file, std::span<const StoredMap> maps,
                     const ChangeNote& note,
                     const std::optional<model::MapReference>& reference = std::nullopt);

}  // namespace understory::map_file
