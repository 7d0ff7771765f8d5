// A file that holds maps: an SQLite database that is at the same time a GeoPackage.
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

/// What a file has of one map, without its rows.
struct MapSummary {
  std::uint32_t map_id = 0;
  std::string name;
  model::Utime created_utime = 0;
  std::string origin;
  std::string
      checksum;  ///< SHA-256 of its content as the file states it; equal content, equal sum.
  std::uint64_t trunks = 0;
  std::uint64_t corners = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t submap_borders = 0;
  std::uint64_t loop_closures = 0;
  std::uint64_t existence_states = 0;  ///< Landmarks with a state of existence ...
  std::uint64_t not_in_use = 0;        ///< ... and those of them that are taken for gone.
};

/// Where submaps of one map are, and closures that are new in it.
struct Placement {
  std::vector<model::SubmapPose> submaps;
  std::vector<model::LoopClosure> closures;  ///< Each with a number that the map does not have.
};

/// An open map file. Everything throws MapFileError, which names the file.
///
/// Open for reading it shows one state, whatever others do. Open for writing nobody else can read
/// or write it; each change is one transaction, on the device when the call returns, and recorded
/// with the rows as they were before. Killed at any moment the file has every change that was
/// finished. Closed it is a single file in SQLite's plain format.
class MapFile {
 public:
  /// Opens what is there. Where a process was killed while it wrote, its last finished change is
  /// brought into the file first, if that can be written. A drive's file (drive_file.hpp) whose
  /// store was killed is sealed first. O(1) but for that.
  MapFile(const std::filesystem::path& file, Access access);
  ~MapFile();
  /// The other one is closed.
  MapFile(MapFile&&) noexcept;
  MapFile& operator=(MapFile&&) = delete;

  /// The file as it was given.
  const std::filesystem::path& file() const;
  /// All maps, ascending by number. O(size).
  std::vector<MapSummary> maps() const;
  /// One map, as it was put in: its checksum is compared (Fault::kDamaged). O(size).
  StoredMap read(std::uint32_t map_id) const;
  /// The submaps of a map that a drive left, in order of id, where they are; those whose content is
  /// in others are not among them, and none in a file without submaps. O(size).
  std::vector<model::Submap> submaps(std::uint32_t map_id) const;
  /// Its loop closures that count, in the order in which they came, without covariances.
  std::vector<model::LoopClosure> closures(std::uint32_t map_id) const;
  /// Where the frame of its maps lies on the earth; none where that is not known.
  std::optional<model::MapReference> reference() const;
  /// All changes, the oldest first.
  std::vector<Change> history() const;
  /// The version of Understory that wrote it last; empty where an older one did, which stated none.
  std::string program_version() const;
  /// All that is wrong with it, a line each: pages and indexes of SQLite, tables and rows that a
  /// GeoPackage must have, values, checksums of maps and of changes. O(size).
  std::vector<std::string> check() const;

  /// Puts maps in as one change and gives its number; a map of the same number is replaced, the
  /// others stay. All or none of it.
  std::uint64_t put(std::span<const StoredMap> maps, const ChangeNote& note);
  /// Likewise one map, with where its submaps are now: as one change, which revert() takes back
  /// whole. Fault::kRefused where a submap is none of the map's, or a closure's number is taken.
  std::uint64_t put(const StoredMap& map, const Placement& placement, const ChangeNote& note);
  /// Says where the frame of all its maps lies on the earth; coordinates stay as they are. A
  /// change, whose number it gives. O(features).
  std::uint64_t put(const model::MapReference& reference, const ChangeNote& note);
  /// Brings all maps back to what they were after change `to` (0: before the first one), as a
  /// change of its own whose number it gives; it can be reverted, too. What other programs changed
  /// becomes a change before it. Fault::kRefused where there is no change `to`. O(all changes).
  std::uint64_t revert(std::uint64_t to, const ChangeNote& note);
  /// Takes what other programs changed in maps over as a change and gives its number: from then on
  /// it is what the checksums say. Fault::kRefused where they changed nothing, kDamaged where a map
  /// is none any more. O(all changes).
  std::uint64_t accept(const ChangeNote& note);

 private:
  std::unique_ptr<Connection> connection_;
  Access access_;
};

/// Makes a new file with these maps, and with where their frame lies, as its first change: whole,
/// or not at all. Links are followed. Fault::kRefused where something is there already. Killed in
/// between, it leaves at most a file FILE.part-XXXXXX.
void create_map_file(const std::filesystem::path& file, std::span<const StoredMap> maps,
                     const ChangeNote& note,
                     const std::optional<model::MapReference>& reference = std::nullopt);

}  // namespace understory::map_file
