// MCAP files (version 0), for Foxglove, Lichtblick, PlotJuggler and `mcap`.
//
// Messages go into chunks, each with an index by time; the summary at the end repeats schemas and
// channels and contains statistics and the place of every chunk, so that a reader finds any time
// without reading the rest. CRCs cover chunks, data section and summary.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "common/mcap/records.hpp"

namespace understory::mcap {

/// Options of writing a file.
struct WriterOptions {
  std::string profile = {};               ///< Profile of the file; empty = none of the known ones.
  std::string library = "understory";     ///< Name of the writing program.
  std::size_t chunk_bytes = 1024 * 1024;  ///< A chunk ends at this size, uncompressed.
  bool compresses = true;                 ///< True: with zstd; false: uncompressed.
};

/// Writes a file completely or not at all (io::WholeFile). Memory: one chunk, and about 200 bytes
/// for each chunk before it (a log of 10 GB: 2 MB).
class Writer {
 public:
  /// Throws io::DataError with the file name where it cannot be created.
  explicit Writer(const std::filesystem::path& path, const WriterOptions& options = {});
  ~Writer();
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Adds a schema; returns its id, from 1. It is written with the first message that needs it.
  std::uint16_t add(const Schema& schema);
  /// Adds a channel; returns its id, from 1. It is written with its first message.
  std::uint16_t add(const Channel& channel);
  /// Appends a message of a channel of add(); in any order of times. Throws io::DataError (e.g. a
  /// full disk), std::out_of_range for a channel that was not added.
  void write(const Message& message);
  /// Writes the summary and gives the file its name; no write() may follow. Throws io::DataError.
  void commit();
  /// Counts so far.
  const Statistics& statistics() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace understory::mcap
