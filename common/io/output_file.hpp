// Files that are written whole or not at all, without harm to what stands at their name.
#pragma once

#include <filesystem>
#include <string_view>

namespace understory::io {

/// The file that `file` leads to: symbolic links are followed, also where the last one leads to
/// nothing yet, so that writing makes or replaces their target and never the link. Throws DataError
/// naming the file where links lead in a circle.
std::filesystem::path behind_links(const std::filesystem::path& file);

/// Whether both names lead to one existing file.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Whether the name leads to something that exists and is no regular file: a device, a pipe.
bool is_special(const std::filesystem::path& file);

/// Writes the file whole or not at all: beside the target, which is then replaced. Devices and
/// pipes, and a file that is this process's standard output or error (/dev/stdout), are written
/// directly instead. Throws DataError naming the file and the cause; nothing is left behind then.
void write_whole_file(const std::filesystem::path& file, std::string_view text);

}  // namespace understory::io
