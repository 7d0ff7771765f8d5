// Text files, written whole or not at all.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace understory::cli {

/// Links are followed, devices written directly (`io::write_whole_file`). Throws std::runtime_error
/// naming the file; nothing is left behind then.
void write_text_file(const std::filesystem::path& file, const std::string& text);

/// JSON as text, `indent` -1 = on one line. What is no UTF-8 is replaced by U+FFFD, whatever is not
/// ASCII is written as \\uXXXX: nothing that a process sends ends the command or steers a terminal.
std::string dumped(const nlohmann::ordered_json& json, int indent);

/// The same of a command's result: an object, with "version" of the program in front.
std::string result_text(const nlohmann::ordered_json& result, int indent);

}  // namespace understory::cli
