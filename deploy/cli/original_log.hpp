// A log that did not come from the bus: its first event says which program made it.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "common/io/lcm_log.hpp"
#include "common/model/map.hpp"

namespace understory::cli {

/// Writes a log as io::LcmLogWriter does, whole or not at all, with a CONFIG of the program in
/// front of the first event, at the time of that.
class OriginalLog {
 public:
  /// `program`: the process of CONFIG, e.g. "understory sim". Throws LogError when the file cannot
  /// be created.
  OriginalLog(const std::string& file, std::string program)
      : writer_(file), program_(std::move(program)) {}

  /// Throws LogError.
  void write(model::Utime utime, std::string_view channel, std::span<const std::uint8_t> data);
  /// The log takes its name. Throws LogError.
  void commit() { writer_.commit(); }

 private:
  io::LcmLogWriter writer_;
  std::string program_;
};

}  // namespace understory::cli
