// Reads small files completely.
#pragma once

#include <filesystem>
#include <string>

namespace understory::io {

/// All bytes of a file. Throws DataError with the file where it is not a file or cannot be read
/// completely.
std::string read_whole_file(const std::filesystem::path& file);

}  // namespace understory::io
