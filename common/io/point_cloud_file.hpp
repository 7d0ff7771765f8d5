// PCD files (version 0.7): ascii, binary and binary_compressed. A reader of our own: PCL's costs
// half a minute of compiling and 200 MB of packages for a header of ten lines; liblzf unpacks.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/model/point_sweep.hpp"

namespace understory::io {

/// Fields x, y, z; where there: intensity, ring, and the time of each point as t, time, timestamp
/// or offset_time (seconds from the first point; integers are nanoseconds; absolute times are made
/// relative). Points that are not finite are left out. Throws DataError.
model::PointSweep parse_pcd(std::string_view bytes, std::string_view source);

/// LZF, as PCD uses it; throws DataError where the data is not what it should be.
std::string decompress_lzf(std::string_view compressed, std::size_t size, std::string_view source);

/// One file of a sequence and the time of its first point.
struct PcdFile {
  model::Utime utime = 0;
  std::filesystem::path path;
};
/// The .pcd files of a folder in order of time: from timestamps.txt (one number of seconds per
/// file), else from names that are a number of seconds or of nanoseconds. Throws DataError.
std::vector<PcdFile> find_pcd_sequence(const std::filesystem::path& folder);

}  // namespace understory::io
