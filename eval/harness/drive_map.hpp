// The map of one drive as the file with which the next one begins.
#pragma once

#include <filesystem>
#include <string>

#include "eval/harness/chain_drive.hpp"

namespace understory::eval::harness {

/// Writes the last map of a drive with what its existence tracker knows. Needs a landmark and an
/// update; throws MapFileError as map files do.
void write_drive_map(const ChainRun& run, const std::string& name,
                     const std::filesystem::path& file);

/// A folder for map files below the system's own for temporary ones, gone with it.
class MapFolder {
 public:
  /// Its name has `name` and a process number in it. Throws std::filesystem::filesystem_error.
  explicit MapFolder(const std::string& name);
  ~MapFolder();
  MapFolder(const MapFolder&) = delete;
  MapFolder& operator=(const MapFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace understory::eval::harness
