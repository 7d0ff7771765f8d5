// Files with one cloud each: PCD (version 0.7), PLY, and KITTI's .bin. These are own readers: PCL
// would cost half a minute of compile time and 200 MB of packages for headers of ten lines; liblzf
// unpacks.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "common/bag/messages.hpp"

namespace understory::bag {

/// The points of one file, as input of CloudDecoder. `cloud.header` is left empty.
struct CloudFile {
  std::vector<std::uint8_t> points;  ///< `cloud.data` refers to it.
  PointCloud cloud;
  /// VIEWPOINT of a PCD file. Its meaning is ambiguous: PCL's viewer moves the points by it, PCL's
  /// filters treat the points as already moved.
  Eigen::Isometry3d viewpoint = Eigen::Isometry3d::Identity();

  CloudFile() = default;
  CloudFile(CloudFile&&) = default;
  CloudFile& operator=(CloudFile&&) = default;
};

// Each throws io::DataError with `source` where the file has another format or is cut off.

/// ascii, binary or binary_compressed. Padding (`_`) is skipped; of a field with several values the
/// first one is used.
CloudFile parse_pcd(std::string_view bytes, std::string_view source);
/// The vertices of a PLY file, ascii or binary in either byte order. CloudCompare's prefix
/// `scalar_` is removed from names.
CloudFile parse_ply(std::string_view bytes, std::string_view source);
/// x, y, z, intensity (0 .. 1) as float32, as in the KITTI sets.
CloudFile parse_kitti_bin(std::string_view bytes, std::string_view source);
/// Parser by the extension of `file`: .pcd, .ply or .bin.
CloudFile parse_cloud_file(std::string_view bytes, const std::filesystem::path& file);

/// One file of a sequence and the time in its name.
struct CloudEntry {
  model::Utime utime = 0;
  std::filesystem::path path;
};
/// The .pcd, .ply or .bin files of a folder in order of time. Times: from timestamps.txt or
/// times.txt in the folder or its parent (one line per file in order of names: seconds, or a date
/// of ISO 8601; if there are more lines than files, a file's name is its line number from 0). Else
/// from the names: seconds, milliseconds, microseconds or nanoseconds since 1970, or seconds of a
/// clock with small numbers. Names that count 0, 1, 2 or 1, 2, 3 are periods of `rate_hz`, and
/// refused if it is 0. Throws io::DataError.
std::vector<CloudEntry> find_cloud_sequence(const std::filesystem::path& folder,
                                            double rate_hz = 0.0);

}  // namespace understory::bag
