// A log that is not from the bus: its first event states the program that made it.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "common/io/lcm_log.hpp"
#include "common/model/map.hpp"

namespace understory::cli {

/// Writes a log like io::LcmLogWriter, completely or not at all, with a CONFIG of the program
/// before the first event, at the same time.
class OriginalLog {
 public:
  /// `program`: the process of CONFIG, e.g. "understory sim". Throws LogError where the file cannot
  /// be created.
  OriginalLog(const std::string& file, std::string program)
      : writer_(file), program_(std::move(program)) {}

  /// Throws LogError.
  void write(model::Utime utime, std::string_view channel, std::span<const std::uint8_t> data);
  /// Gives the log its name. Throws LogError.
  void commit() { writer_.commit(); }

 private:
  io::LcmLogWriter writer_;
  std::string program_;
};

}  // namespace understory::cli
