#include "common/bus/config_file.hpp"

#include "common/bus/parameter_table.hpp"
#include "common/io/data_error.hpp"
#include "common/io/text_file.hpp"

namespace understory::bus {

std::string read_config_file(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    throw ConfigurationError({file.string() + ": is a folder, not a configuration file"});
  }
  try {
    return io::read_whole_file(file);
  } catch (const io::DataError& error) {
    throw ConfigurationError({error.what()});
  }
}

}  // namespace understory::bus
