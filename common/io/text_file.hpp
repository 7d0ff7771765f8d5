// Files that are small enough to be read whole.
#pragma once

#include <filesystem>
#include <string>

namespace understory::io {

/// All bytes of a file. Throws DataError naming the file where it is no file or cannot be read to
/// its end.
std::string read_whole_file(const std::filesystem::path& file);

}  // namespace understory::io
