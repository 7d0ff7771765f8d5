// A small reader of MCAP files that believes nothing: it walks every record and compares every
// offset, count and checksum with what it finds.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace understory::test {

struct McapMessage {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0;
  std::uint64_t publish_time = 0;
  std::string data;
};

struct McapChannel {
  std::uint16_t schema = 0;
  std::string topic;
  std::string encoding;
};

/// What is in a file. Throws std::runtime_error naming what is wrong.
struct McapFile {
  std::string profile;
  std::string library;
  std::map<std::uint16_t, std::string> schemas;  ///< Names by id.
  std::map<std::uint16_t, McapChannel> channels;
  std::vector<McapMessage> messages;  ///< In the order of the file.
  std::size_t chunks = 0;
};

McapFile read_mcap(std::string_view bytes);

/// The bytes of a file.
std::string bytes_of(const std::string& path);

}  // namespace understory::test
