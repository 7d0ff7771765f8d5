// A map file that is looked at, and not touched.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/map_file/map_file.hpp"

namespace understory::map_file {

/// A file as it is, though its last writer was killed: where a log or a journal lies beside it, or
/// a drive's store did not end, a copy of it in the folder for temporary files is brought in
/// instead, and is gone at the end. Nothing in the file's own folder changes.
class MapLook {
 public:
  /// Cost O(1), or O(size) for a copy. Throws MapFileError as MapFile does, Fault::kInUse where a
  /// process writes. In this process the file must not be open otherwise: locks on it would end.
  explicit MapLook(const std::filesystem::path& file);
  ~MapLook();
  MapLook(const MapLook&) = delete;
  MapLook& operator=(const MapLook&) = delete;

  /// What is in it.
  const MapFile& file() const { return *opened_; }
  /// What was left and is shown as if it were brought in; empty where the file is at rest.
  const std::string& remark() const { return remark_; }

 private:
  std::filesystem::path folder_;  ///< Of the copy; empty where there is none.
  std::string remark_;
  std::unique_ptr<MapFile> opened_;
};

}  // namespace understory::map_file
