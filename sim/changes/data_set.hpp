// Changed drives as a folder of files for other programs: its README.txt explains each.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "sim/changes/changed_drive.hpp"

namespace understory::sim::changes {

/// Description of a data set.
struct DataSetInfo {
  SceneKind scene = SceneKind::kOffice;
  std::uint64_t seed = 0;
  double share = 0.0;  ///< Of the things changed in each copy but the first.
  double move_m = 0.0;
  CameraParameters camera;
};

/// A file of the data set.
struct DataSetFile {
  std::string name;         ///< Relative to the folder, e.g. "copy_1/points.csv".
  std::uint64_t bytes = 0;  ///< Its size.
};

/// Writes a data set, as a whole or not at all: manifest.json is written last, and without commit()
/// the copies are removed again.
class DataSetWriter {
 public:
  /// Creates the folder. Throws io::DataError if it cannot be created or is not empty.
  DataSetWriter(std::filesystem::path folder, DataSetInfo info);
  ~DataSetWriter();
  DataSetWriter(const DataSetWriter&) = delete;
  DataSetWriter& operator=(const DataSetWriter&) = delete;

  /// Writes the tables and the cloud of the next copy; the first one is the unchanged one. Throws
  /// io::DataError.
  void add(const ChangedDrive& drive, const Stage& copy);
  /// Path for a further file of the latest copy, e.g. "drive.lcm".
  std::filesystem::path path_in_copy(std::string_view name) const;
  /// Records a further file of the latest copy after it was written.
  void add_file(std::string_view name);
  /// Writes README.txt and the manifest. Throws io::DataError.
  void commit();

 private:
  void write(std::string_view name, std::string_view text);

  std::filesystem::path folder_;
  DataSetInfo info_;
  int copies_ = 0;
  std::vector<DataSetFile> files_;
  bool is_whole_ = false;
};

/// A PCD file (0.7, binary) with fields x, y, z and label, the id of the object.
std::string pcd_of(const std::vector<MappedPoint>& cloud);

}  // namespace understory::sim::changes
