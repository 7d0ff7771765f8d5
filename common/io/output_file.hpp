// Files that are written completely or not at all, and never damage an existing file.
#pragma once

#include <filesystem>
#include <string_view>

namespace understory::io {

/// The file that `file` leads to: symbolic links are followed, also to a missing target, so that
/// writing creates or replaces the target and never the link. Throws DataError with the file where
/// links form a circle.
std::filesystem::path behind_links(const std::filesystem::path& file);

/// Whether both names lead to one existing file.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Whether the name leads to something that exists and is not a regular file: a device, a pipe.
bool is_special(const std::filesystem::path& file);

/// Writes the file completely or not at all: into a temporary file beside the target, which it then
/// replaces. Devices and pipes, and a file that is this process's standard output or error
/// (/dev/stdout), are written directly instead. Throws DataError with the file and the cause; then
/// no file is left.
void write_whole_file(const std::filesystem::path& file, std::string_view text);

}  // namespace understory::io
