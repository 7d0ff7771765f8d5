// Text files, written whole or not at all.
#pragma once

#include <filesystem>
#include <string>

namespace understory::cli {

/// Throws std::runtime_error naming the file; nothing is left behind then.
void write_text_file(const std::filesystem::path& file, const std::string& text);

}  // namespace understory::cli
