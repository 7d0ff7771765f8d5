#include "common/io/text_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <sstream>

#include "common/io/data_error.hpp"

namespace understory::io {

std::string read_whole_file(const std::filesystem::path& file) {
  std::ostringstream text;
  std::error_code ignored;
  if (!std::filesystem::is_directory(file, ignored)) {
    std::ifstream stream(file, std::ios::binary);
    const bool is_empty = stream.peek() == std::ifstream::traits_type::eof() && !stream.bad();
    if (stream.is_open() && (is_empty || text << stream.rdbuf())) return text.str();
  }
  throw DataError(fmt::format("{}: cannot be read", file.string()));
}

}  // namespace understory::io
