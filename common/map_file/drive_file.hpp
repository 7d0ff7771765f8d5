// The file that a drive is written into while it goes on: a map file whose maps follow the drive.
//
// From its first write until seal() such a file is open: its layers change outside of the history,
// and the maps' checksums are old. seal() makes all that changed one change of the history. Who
// finds an open file that nobody writes any more (its store was killed) seals it.
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

/// What became of a submap that was to be kept.
enum class Keeping : std::uint8_t {
  kNew,      ///< It is in the file now.
  kAlready,  ///< It was, with the same content.
  kOther,    ///< The file has another one of this number; nothing was changed.
};

/// A drive's file, for this process alone. Every call that writes is one transaction, on the device
/// when it returns. All throw MapFileError; nothing of the call has then been written.
class DriveFile {
 public:
  /// Makes an empty one. Fault::kRefused where something is there already.
  static void make(const std::filesystem::path& file);
  /// Opens one, or any other map file. Without `is_lasting`, a file that nobody needs after this
  /// process: its calls do not wait for the device.
  explicit DriveFile(const std::filesystem::path& file, bool is_lasting = true);
  /// What is open stays so; in SQLite's plain format, where there is room for that.
  ~DriveFile();
  DriveFile(const DriveFile&) = delete;
  DriveFile& operator=(const DriveFile&) = delete;

  /// The file as it was given.
  const std::filesystem::path& file() const;
  /// Throws Fault::kUnreadable where its name does not lead to it any more (moved away, something
  /// else in its place), kDamaged where it was cut: what is written would be lost. O(1).
  void require_in_place() const;
  /// Whether a drive may go on in it: nobody has changed its maps since a store sealed it.
  bool may_go_on() const;
  /// The newest stamp that was written [us]; none in an empty file.
  std::optional<model::Utime> newest() const;
  /// The highest number of a map; 0 where there is none.
  std::uint32_t highest_map() const;

  /// Keeps a submap, shows it at the pose, and lets go of those that it replaces.
  Keeping put(const model::Submap& submap, const geometry::SE2& map_T_submap);
  /// A submap that is kept; none where there is none.
  std::optional<model::Submap> get(const SubmapKey& key) const;
  /// Takes over poses; their borders move at once, their landmarks and keyframes by draw().
  void put(const model::MapCorrection& correction);
  /// Takes over what changed in the map that the mapper holds. Gives how many landmarks and
  /// keyframes were left out, because no map can have them.
  std::size_t put(const GroundChange& change);
  /// Takes over states of existence; one that is older than what the file has is passed over.
  /// Nothing where the file has no such map. States of landmarks that are in no map when the drive
  /// is sealed go then.
  void put(std::uint32_t map_id, const StoredExistence& existence);
  /// The same of a message as it comes. Fault::kRefused where fault_of() finds something in it.
  void put(const model::ExistenceState& state);
  /// A loop closure counts.
  void put(const model::LoopClosure& closure);
  /// A loop closure does not count any more.
  void take_back(std::uint32_t map_id, std::uint64_t closure_id);
  /// Takes a map out, with its submaps; nothing where there is none.
  void drop(std::uint32_t map_id);

  /// Shows at most so many of the submaps that a correction moved; gives how many it were.
  std::size_t draw(std::size_t most);
  /// Rows that seal() has to look at.
  std::uint64_t size() const;
  /// Draws all and makes what changed since the last time one change of the history; nothing where
  /// nothing changed. O(size), and O(all changes).
  void seal();

 private:
  void begin(std::uint32_t map_id, model::Utime utime);

  std::unique_ptr<Connection> connection_;
  std::uint64_t device_ = 0;  ///< It and `inode_` say which file it is.
  std::uint64_t inode_ = 0;
  mutable std::uint64_t largest_ = 0;  ///< Bytes that it has had; it never shrinks.
};

/// A submap of a drive's file that is not open, as DriveFile::get() gives it. Throws MapFileError.
std::optional<model::Submap> submap_in(const std::filesystem::path& file, const SubmapKey& key);

/// Whether a drive's file was left before it was sealed.
bool is_open_drive(const Connection& connection);
/// Seals a file that was; see DriveFile::seal(). The connection is open to write, in no
/// transaction.
void seal_drive(const Connection& connection);

}  // namespace understory::map_file
