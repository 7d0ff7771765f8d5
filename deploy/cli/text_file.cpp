#include "deploy/cli/text_file.hpp"

#include <nlohmann/json.hpp>

#include "common/io/output_file.hpp"
#include "common/model/program_version.hpp"

namespace understory::cli {

void write_text_file(const std::filesystem::path& file, const std::string& text) {
  io::write_whole_file(file, text);
}

std::string dumped(const nlohmann::ordered_json& json, int indent) {
  std::string text = json.dump(indent, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
  // DEL is ASCII and needs no escape in JSON, but a terminal erases a character for it.
  for (std::size_t at = 0; (at = text.find('\x7F', at)) != std::string::npos; at += 6) {
    text.replace(at, 1, "\\u007f");
  }
  return text;
}

std::string result_text(const nlohmann::ordered_json& result, int indent) {
  nlohmann::ordered_json document{{"version", model::program_version()}};
  document.update(result);
  return dumped(document, indent);
}

}  // namespace understory::cli
