#include "common/mcap/records.hpp"

#include <algorithm>

#include "common/mcap/encoder.hpp"

namespace understory::mcap {
namespace {

/// Map<uint16, uint64>.
void append_counts(Encoder& out, const std::map<std::uint16_t, std::uint64_t>& counts) {
  out.u32(static_cast<std::uint32_t>(counts.size() * 10));
  for (const auto& [key, value] : counts) {
    out.u16(key);
    out.u64(value);
  }
}

}  // namespace

void TimeSpan::take(std::uint64_t time_ns, bool is_first) {
  start_ns = is_first ? time_ns : std::min(start_ns, time_ns);
  end_ns = is_first ? time_ns : std::max(end_ns, time_ns);
}

std::string content_of(std::uint16_t id, const Schema& schema) {
  Encoder out;
  out.u16(id);
  out.text(schema.name);
  out.text(schema.encoding);
  out.text(schema.data);
  return out.bytes();
}

std::string content_of(std::uint16_t id, const Channel& channel) {
  Encoder metadata;
  for (const auto& [key, value] : channel.metadata) {
    metadata.text(key);
    metadata.text(value);
  }

  Encoder out;
  out.u16(id);
  out.u16(channel.schema_id);
  out.text(channel.topic);
  out.text(channel.message_encoding);
  out.text(metadata.bytes());
  return out.bytes();
}

std::string content_of(std::uint16_t channel_id, const MessageIndex& index) {
  Encoder out;
  out.u16(channel_id);
  out.u32(static_cast<std::uint32_t>(index.size() * 16));
  for (const auto& [time_ns, offset] : index) {
    out.u64(time_ns);
    out.u64(offset);
  }
  return out.bytes();
}

std::string content_of(const ChunkIndex& index) {
  Encoder out;
  out.u64(index.time.start_ns);
  out.u64(index.time.end_ns);
  out.u64(index.start);
  out.u64(index.length);
  append_counts(out, index.message_index_offsets);
  out.u64(index.message_index_length);
  out.text(index.compression);
  out.u64(index.compressed_size);
  out.u64(index.uncompressed_size);
  return out.bytes();
}

std::string content_of(const Statistics& statistics) {
  Encoder out;
  out.u64(statistics.message_count);
  out.u16(statistics.schema_count);
  out.u32(statistics.channel_count);
  out.u32(0);  // Attachments.
  out.u32(0);  // Metadata.
  out.u32(statistics.chunk_count);
  out.u64(statistics.time.start_ns);
  out.u64(statistics.time.end_ns);
  append_counts(out, statistics.channel_message_counts);
  return out.bytes();
}

}  // namespace understory::mcap
