// Contents of an MCAP file, and each record's content as bytes. Names as in the specification
// ("Records").
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace understory::mcap {

/// Schema of a channel's messages.
struct Schema {
  std::string name;      ///< For example foxglove.Log.
  std::string encoding;  ///< For example jsonschema.
  std::string data;      ///< The schema in this encoding.
};

/// A stream of messages.
struct Channel {
  std::uint16_t schema_id = 0;  ///< 0 = none.
  std::string topic;
  std::string message_encoding;  ///< For example json.
  std::map<std::string, std::string> metadata;
};

/// One message.
struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;      ///< Time of recording.
  std::uint64_t publish_time_ns = 0;  ///< Time of publication.
  std::string_view data;
};

/// Earliest and latest log time; zero without messages.
struct TimeSpan {
  std::uint64_t start_ns = 0;
  std::uint64_t end_ns = 0;

  /// Extends it; `is_first`: it is still empty.
  void take(std::uint64_t time_ns, bool is_first);
};

/// Place and content of a chunk.
struct ChunkIndex {
  TimeSpan time;
  std::uint64_t start = 0;  ///< Offset of the chunk's record in the file [bytes].
  std::uint64_t length = 0;
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;  ///< Channel -> offset in the file.
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
};

/// Counts of the file's content.
struct Statistics {
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0;
  std::uint32_t chunk_count = 0;
  TimeSpan time;
  std::map<std::uint16_t, std::uint64_t> channel_message_counts;
};

/// Log time and offset in the uncompressed chunk of each message of one channel.
using MessageIndex = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

/// Content of a Schema record.
std::string content_of(std::uint16_t id, const Schema& schema);
/// Content of a Channel record.
std::string content_of(std::uint16_t id, const Channel& channel);
/// Content of a Message Index record.
std::string content_of(std::uint16_t channel_id, const MessageIndex& index);
/// Content of a Chunk Index record.
std::string content_of(const ChunkIndex& index);
/// Content of a Statistics record.
std::string content_of(const Statistics& statistics);

}  // namespace understory::mcap
