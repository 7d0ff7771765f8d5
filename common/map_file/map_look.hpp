// Read access to a map file without any change to it.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/map_file/map_file.hpp"

namespace understory::map_file {

/// Reads a file also if its last writer was killed: if a log or a journal lies beside it, or a
/// drive's store did not end, a temporary copy is recovered instead and deleted at the end. Nothing
/// changes in the file's own folder.
class MapLook {
 public:
  /// Cost O(1), or O(size) for a copy. Throws MapFileError like MapFile, Fault::kInUse where a
  /// process writes. The file must not be open elsewhere in this process, because its locks would
  /// end.
  explicit MapLook(const std::filesystem::path& file);
  ~MapLook();
  MapLook(const MapLook&) = delete;
  MapLook& operator=(const MapLook&) = delete;

  /// The opened file.
  const MapFile& file() const { return *opened_; }
  /// Describes the unfinished state that was recovered in the copy; empty if there was none.
  const std::string& remark() const { return remark_; }

 private:
  std::filesystem::path folder_;  ///< Folder of the copy; empty without a copy.
  std::string remark_;
  std::unique_ptr<MapFile> opened_;
};

}  // namespace understory::map_file
