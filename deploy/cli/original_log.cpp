#include "deploy/cli/original_log.hpp"

#include "common/model/program_version.hpp"
#include "common/wire/convert.hpp"
#include "understory/config_t.hpp"

namespace understory::cli {

void OriginalLog::write(model::Utime utime, std::string_view channel,
                        std::span<const std::uint8_t> data) {
  if (writer_.events() == 0) {
    config_t origin{};
    origin.process = program_;
    origin.version = model::program_version();
    writer_.write(utime, "CONFIG", wire::encode_bytes(origin));
  }
  writer_.write(utime, channel, data);
}

}  // namespace understory::cli
