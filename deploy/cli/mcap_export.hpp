// Exports a log as an MCAP file for Foxglove, Lichtblick and PlotJuggler.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/terminal/progress.hpp"

namespace understory::cli {

/// Summary of an export.
struct McapSummary {
  std::uint64_t messages = 0;  ///< Messages in the MCAP file.
  std::uint64_t refused = 0;   ///< Malformed messages of the log.
  std::uint64_t landmarks_left_out = 0;
};

/// Path of the file: `out` itself if it ends in .mcap, else LOG.mcap in the directory `out`.
std::filesystem::path mcap_path(const std::filesystem::path& log, const std::filesystem::path& out);

/// Writes the messages of common/foxglove for the log, completely or not at all, in bounded memory.
/// Throws io::LogError, io::DataError, terminal::Interrupted.
McapSummary export_mcap(const std::string& log, const std::filesystem::path& file);

}  // namespace understory::cli
