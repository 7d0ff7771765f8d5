// MCAP files (version 0, https://mcap.dev/spec), with or without chunks, indexes and summary.
#pragma once

#include "common/bag/chunked_bag.hpp"

namespace understory::bag {

/// A file, finished or not. It is read record by record; chunks with message indexes are skipped.
class McapFile : public ChunkedBag {
 public:
  /// Throws io::DataError.
  explicit McapFile(const std::filesystem::path& path);
  std::string kind() const override { return "MCAP"; }

 protected:
  void read_records(std::span<const std::uint8_t> records, ChunkContent& content) const override;

 private:
  void walk();
  bool take(std::uint8_t opcode, std::uint64_t offset, std::uint64_t bytes);
  void take_chunk(std::uint64_t offset, std::uint64_t bytes, std::uint64_t in_file);
  void take_index(std::span<const std::uint8_t> content);
  void take_statistics(std::span<const std::uint8_t> content);
  void take_message(std::uint64_t offset, std::uint64_t bytes);
  void take_declaration(std::uint8_t opcode, std::span<const std::uint8_t> content);
  std::vector<std::uint8_t> content_at(std::uint64_t offset, std::uint64_t bytes);

  mutable std::map<std::uint16_t, std::string> types_;  ///< Type name by the schema's number.
  std::uint64_t run_end_ = 0;  ///< End of the last run of messages outside of chunks.
};

}  // namespace understory::bag
