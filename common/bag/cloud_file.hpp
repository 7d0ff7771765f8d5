// Files with one cloud each: PCD (version 0.7), PLY, and KITTI's .bin. Readers of our own: PCL's
// costs half a minute of compiling and 200 MB of packages for headers of ten lines; liblzf unpacks.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "common/bag/messages.hpp"

namespace understory::bag {

/// The points of one file, as CloudDecoder takes them. `cloud.header` is left empty.
struct CloudFile {
  std::vector<std::uint8_t> points;  ///< `cloud.data` refers to it.
  PointCloud cloud;
  /// VIEWPOINT of a PCD file. What it means is open: PCL's viewer moves the points by it, its
  /// filters take the points as moved already.
  Eigen::Isometry3d viewpoint = Eigen::Isometry3d::Identity();

  CloudFile() = default;
  CloudFile(CloudFile&&) = default;
  CloudFile& operator=(CloudFile&&) = default;
};

// Each throws io::DataError, which names `source`, where this is no such file, or it is cut off.

/// ascii, binary or binary_compressed. Padding (`_`) is passed over; of a field with several values
/// the first one counts.
CloudFile parse_pcd(std::string_view bytes, std::string_view source);
/// The vertices of a PLY file, ascii or binary in either byte order. CloudCompare's `scalar_`
/// before a name is taken off.
CloudFile parse_ply(std::string_view bytes, std::string_view source);
/// x, y, z, intensity (0 .. 1) as float32, as in the KITTI sets.
CloudFile parse_kitti_bin(std::string_view bytes, std::string_view source);
/// By the extension of `file`: .pcd, .ply or .bin.
CloudFile parse_cloud_file(std::string_view bytes, const std::filesystem::path& file);

/// One file of a sequence and the time in its name.
struct CloudEntry {
  model::Utime utime = 0;
  std::filesystem::path path;
};
/// The .pcd, .ply or .bin files of a folder in order of time. Times: from timestamps.txt or
/// times.txt in it or in the folder above (a number of seconds, or a date of ISO 8601, for each
/// file, in the order of their names; where these are more, names are numbers of lines from 0),
/// else from their names: numbers of seconds, milliseconds, microseconds or nanoseconds since 1970,
/// or seconds of a short clock; names that count 0, 1, 2 or 1, 2, 3 are times of `rate_hz`, and
/// refused where it is 0. Throws io::DataError.
std::vector<CloudEntry> find_cloud_sequence(const std::filesystem::path& folder,
                                            double rate_hz = 0.0);

}  // namespace understory::bag
