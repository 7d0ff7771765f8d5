// MCAP files (version 0), as Foxglove, Lichtblick, PlotJuggler and `mcap` read them.
//
// Messages go into chunks, each with an index by time; the summary at the end repeats schemas and
// channels and has statistics and the place of every chunk, so that a reader finds any time without
// reading the rest. CRCs cover chunks, data section and summary.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "common/mcap/records.hpp"

namespace understory::mcap {

/// How a file is written.
struct WriterOptions {
  std::string profile = {};               ///< What readers may rely on; none of the known ones.
  std::string library = "understory";     ///< Who wrote it.
  std::size_t chunk_bytes = 1024 * 1024;  ///< A chunk ends at this size, uncompressed.
  bool compresses = true;                 ///< With zstd; else not at all.
};

/// Writes a file whole or not at all (io::WholeFile). Memory: one chunk, and about 200 bytes for
/// each chunk before it (a log of 10 GB: 2 MB).
class Writer {
 public:
  /// Throws io::DataError naming the file when it cannot be created.
  explicit Writer(const std::filesystem::path& path, const WriterOptions& options = {});
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Gives the schema's id, from 1. It gets into the file with the first message that needs it.
  std::uint16_t add(const Schema& schema);
  /// Gives the channel's id, from 1; likewise.
  std::uint16_t add(const Channel& channel);
  /// Appends a message of a channel of add(); the order of times does not matter. Throws
  /// io::DataError (a full disk, say), std::out_of_range for a channel that was not added.
  void write(const Message& message);
  /// Writes the summary and gives the file its name; no write() may follow. Throws io::DataError.
  void commit();
  /// What is in it so far.
  const Statistics& statistics() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::mcap
