// PCD files (version 0.7): ascii, binary and binary_compressed. A reader of our own: PCL's costs
// half a minute of compiling and 200 MB of packages for a header of ten lines; liblzf unpacks.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "common/bag/messages.hpp"

namespace understory::bag {

/// The points of one file, as CloudDecoder takes them. Fields of padding (`_`) are not among its
/// fields; of a field with several values the first one counts. `cloud.header` is left empty.
struct PcdFile {
  std::vector<std::uint8_t> points;  ///< `cloud.data` refers to it.
  PointCloud cloud;
  /// VIEWPOINT. What it means is open: PCL's viewer moves the points by it, its filters take the
  /// points as moved already.
  Eigen::Isometry3d viewpoint = Eigen::Isometry3d::Identity();

  PcdFile() = default;
  PcdFile(PcdFile&&) = default;
  PcdFile& operator=(PcdFile&&) = default;
};

/// Throws io::DataError, which names `source`, where this is no such file, or it is cut off.
PcdFile parse_pcd(std::string_view bytes, std::string_view source);

/// One file of a sequence and the time in its name.
struct PcdEntry {
  model::Utime utime = 0;
  std::filesystem::path path;
};
/// The .pcd files of a folder in order of time: from timestamps.txt (a number of seconds for each
/// file, in the order of their names), else from their names: numbers of seconds, milliseconds,
/// microseconds or nanoseconds since 1970, or seconds of a short clock; names that count 0, 1, 2 or
/// 1, 2, 3 are times of `rate_hz`, and refused where it is 0. Throws io::DataError.
std::vector<PcdEntry> find_pcd_sequence(const std::filesystem::path& folder, double rate_hz = 0.0);

}  // namespace understory::bag
