// A log as an MCAP file for Foxglove, Lichtblick and PlotJuggler.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/terminal/progress.hpp"

namespace understory::cli {

/// What became of a log.
struct McapSummary {
  std::uint64_t messages = 0;  ///< In the MCAP file.
  std::uint64_t refused = 0;   ///< Messages of the log that are not of their type.
  std::uint64_t landmarks_left_out = 0;
};

/// Where the file goes: `out` itself where it ends in .mcap, else LOG.mcap in the directory `out`.
std::filesystem::path mcap_path(const std::filesystem::path& log, const std::filesystem::path& out);

/// Writes all that common/foxglove makes of the log, whole or not at all, in bounded memory. Throws
/// io::LogError, io::DataError, terminal::Interrupted.
McapSummary export_mcap(const std::string& log, const std::filesystem::path& file);

}  // namespace understory::cli
