// The states of a stored map after each of its changes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/map_file/map_file.hpp"
#include "services/viewer/scene.hpp"

namespace understory::cli {

/// The states of a map file; the file itself is never written.
class MapRevisions {
 public:
  /// Throws map_file::MapFileError.
  explicit MapRevisions(std::filesystem::path file);
  ~MapRevisions();
  MapRevisions(const MapRevisions&) = delete;
  MapRevisions& operator=(const MapRevisions&) = delete;

  /// The changes, the oldest first.
  const std::vector<map_file::Change>& changes() const { return changes_; }
  /// All maps after change `number`. A copy of the file is reverted: O(file).
  std::vector<map_file::StoredMap> after(std::uint64_t number) const;

 private:
  std::filesystem::path file_;
  std::vector<map_file::Change> changes_;
  std::filesystem::path folder_;  ///< Folder for copies; removed at the end.
};

/// Replaces the scene's maps.
void show(const std::vector<map_file::StoredMap>& maps, viewer::Scene& scene);

}  // namespace understory::cli
