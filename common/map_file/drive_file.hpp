// The file of a running drive: a map file whose maps follow the drive.
//
// From its first write until seal() such a file is open: its layers change outside of the history,
// and the maps' checksums are old. seal() records all changes as one change of the history. A
// process that finds an open file without a writer (its store was killed) seals it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/map_file/history.hpp"
#include "common/map_file/stored_existence.hpp"
#include "common/map_file/submap_layers.hpp"
#include "common/map_file/submap_rows.hpp"

namespace understory::map_file {

/// Result of storing a submap.
enum class Keeping : std::uint8_t {
  kNew,      ///< It was stored.
  kAlready,  ///< It was in the file already, with the same content.
  kOther,    ///< The file has another one of this number; nothing was changed.
};

/// A drive's file, exclusive to this process. Every writing call is one transaction, on the device
/// at its return. All calls throw MapFileError; then nothing of the call was written.
class DriveFile {
 public:
  /// Creates an empty file. Fault::kRefused where the name exists already.
  static void make(const std::filesystem::path& file);
  /// Opens it, or any other map file. Without `is_lasting` the file is temporary, and calls do not
  /// wait for the device.
  explicit DriveFile(const std::filesystem::path& file, bool is_lasting = true);
  /// An open file stays open (not sealed); it is converted to SQLite's plain format if the device
  /// has room.
  ~DriveFile();
  DriveFile(const DriveFile&) = delete;
  DriveFile& operator=(const DriveFile&) = delete;

  /// The file given to the constructor.
  const std::filesystem::path& file() const;
  /// Throws Fault::kUnreadable where its name no longer leads to it (moved or replaced), kDamaged
  /// where it was cut: writes would be lost. O(1).
  void require_in_place() const;
  /// Whether a drive may continue in it: its maps are unchanged since a store sealed it.
  bool may_go_on() const;
  /// The newest stamp written [us]; none in an empty file.
  std::optional<model::Utime> newest() const;
  /// The highest number of a map; 0 where there is none.
  std::uint32_t highest_map() const;

  /// Stores a submap, shows it at the pose, and drops the submaps that it replaces.
  Keeping put(const model::Submap& submap, const geometry::SE2& map_T_submap);
  /// A stored submap; none where there is none.
  std::optional<model::Submap> get(const SubmapKey& key) const;
  /// Stores poses; their borders move at once, their landmarks and keyframes by draw().
  void put(const model::MapCorrection& correction);
  /// Stores changes of the map in the mapper's memory. Returns the number of landmarks and
  /// keyframes left out because they are invalid.
  std::size_t put(const GroundChange& change);
  /// Stores states of existence; states older than those in the file are skipped. No effect if the
  /// file has no such map. Sealing removes states of landmarks that are in no map.
  void put(std::uint32_t map_id, const StoredExistence& existence);
  /// The same for a received message. Fault::kRefused where fault_of() finds a fault.
  void put(const model::ExistenceState& state);
  /// Stores a loop closure.
  void put(const model::LoopClosure& closure);
  /// Removes a revoked loop closure.
  void take_back(std::uint32_t map_id, std::uint64_t closure_id);
  /// Removes a map with its submaps; no effect where there is none.
  void drop(std::uint32_t map_id);

  /// Redraws at most `most` of the submaps moved by a correction; returns their number.
  std::size_t draw(std::size_t most);
  /// Number of rows that seal() must read.
  std::uint64_t size() const;
  /// Redraws all and records the changes since the last seal() as one change of the history; no
  /// effect without changes. O(size), and O(all changes).
  void seal();

 private:
  void begin(std::uint32_t map_id, model::Utime utime);

  std::unique_ptr<Connection> connection_;
  std::uint64_t device_ = 0;  ///< With `inode_` the identity of the file.
  std::uint64_t inode_ = 0;
  mutable std::uint64_t largest_ = 0;  ///< Largest size so far [bytes]; the file never shrinks.
};

/// A submap of a drive's file that this process has not opened, as from DriveFile::get(). Throws
/// MapFileError.
std::optional<model::Submap> submap_in(const std::filesystem::path& file, const SubmapKey& key);

/// Whether a drive's file was left without sealing.
bool is_open_drive(const Connection& connection);
/// Seals such a file; see DriveFile::seal(). The connection is open for writing, outside of a
/// transaction.
void seal_drive(const Connection& connection);

}  // namespace understory::map_file
