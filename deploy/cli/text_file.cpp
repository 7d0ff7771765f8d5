#include "deploy/cli/text_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>

namespace understory::cli {

void write_text_file(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path part = file.string() + ".part";
  std::ofstream out(part, std::ios::binary);
  out << text;
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(part, file, error);
  if (out && !error) return;
  std::filesystem::remove(part, error);
  throw std::runtime_error(fmt::format("{}: cannot be written", file.string()));
}

}  // namespace understory::cli
