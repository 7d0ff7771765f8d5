// Text files, written completely or not at all.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace understory::cli {

/// Links are followed, devices written directly (`io::write_whole_file`). Throws std::runtime_error
/// with the file; then no file is left.
void write_text_file(const std::filesystem::path& file, const std::string& text);

/// JSON as text, `indent` -1 = on one line. Invalid UTF-8 is replaced by U+FFFD, and non-ASCII
/// characters are written as \\uXXXX, so that no text of a process can end the command or control a
/// terminal.
std::string dumped(const nlohmann::ordered_json& json, int indent);

/// The same for a command's result: an object, with the program's "version" first.
std::string result_text(const nlohmann::ordered_json& result, int indent);

}  // namespace understory::cli
