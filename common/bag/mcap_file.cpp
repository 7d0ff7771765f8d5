#include "common/bag/mcap_file.hpp"

#include <algorithm>
#include <array>

#include "common/bag/byte_reader.hpp"
#include "common/bag/unpack.hpp"
#include "common/io/data_error.hpp"
#include "common/mcap/encoder.hpp"

namespace understory::bag {
namespace {

using Bytes = std::span<const std::uint8_t>;
using mcap::Opcode;

/// Largest record other than chunks, messages and attachments [bytes].
constexpr std::uint64_t kLargestContent = 64U << 20U;
/// Messages outside of chunks are read in runs of about this size.
constexpr std::uint64_t kRunBytes = 4U << 20U;

bool is(std::uint8_t opcode, Opcode wanted) { return opcode == static_cast<std::uint8_t>(wanted); }

std::int64_t read_time(ByteReader& reader) {
  return bounded_time(static_cast<std::int64_t>(reader.number<std::uint64_t>()));
}

/// Reads a channel with the name of its type.
ChannelInfo channel_of(ByteReader& content, const std::map<std::uint16_t, std::string>& types) {
  const auto schema = content.number<std::uint16_t>();
  ChannelInfo channel;
  channel.topic = content.text();
  channel.encoding = content.text();
  const auto type = types.find(schema);
  channel.type = type == types.end() ? std::string() : type->second;
  return channel;
}

/// Whether a record may begin with this byte; for the end of a file that was cut off.
bool is_opcode(std::uint8_t opcode) { return opcode >= 1 && (opcode <= 0x0F || opcode >= 0x80); }

}  // namespace

McapFile::McapFile(const std::filesystem::path& path) : ChunkedBag(path) {
  walk();
  distrust_last_index();
  finish_opening();
}

std::vector<std::uint8_t> McapFile::content_at(std::uint64_t offset, std::uint64_t bytes) {
  if (bytes > kLargestContent) throw CutOff(0);
  std::vector<std::uint8_t> content(bytes);
  if (!read(offset, content)) throw CutOff(0);
  return content;
}

void McapFile::walk() {
  std::uint64_t offset = mcap::kMagic.size();
  std::array<std::uint8_t, mcap::kRecordHead> head{};

  while (true) {
    if (!read(offset, head)) return stop_at(offset, "cut off");
    ByteReader reader(head);
    const auto opcode = reader.number<std::uint8_t>();
    const auto bytes = reader.number<std::uint64_t>();
    if (!is_opcode(opcode)) return stop_at(offset, "no record");
    const std::uint64_t content = offset + head.size();
    const std::uint64_t left = size() - content;

    if (bytes > left) {
      stop_at(offset, "cut off");
      if (is(opcode, Opcode::kChunk)) {
        try {
          take_chunk(content, left, left);
        } catch (const CutOff&) {
          // The chunk's header is incomplete: nothing of the chunk is readable.
        }
      }
      return;
    }

    try {
      if (!take(opcode, content, bytes)) return;
    } catch (const CutOff&) {
      return stop_at(offset, "damaged");
    }
    offset = content + bytes;
  }
}

/// Returns false after the last record.
bool McapFile::take(std::uint8_t opcode, std::uint64_t offset, std::uint64_t bytes) {
  if (is(opcode, Opcode::kFooter)) return false;
  if (is(opcode, Opcode::kChunk)) {
    take_chunk(offset, bytes, bytes);
  } else if (is(opcode, Opcode::kMessage)) {
    take_message(offset, bytes);
  } else if (is(opcode, Opcode::kMessageIndex)) {
    take_index(content_at(offset, bytes));
  } else if (is(opcode, Opcode::kStatistics)) {
    take_statistics(content_at(offset, bytes));
  } else if (is(opcode, Opcode::kSchema) || is(opcode, Opcode::kChannel)) {
    take_declaration(opcode, content_at(offset, bytes));
  }
  return true;
}

void McapFile::take_declaration(std::uint8_t opcode, Bytes content) {
  ByteReader reader(content);
  const auto id = reader.number<std::uint16_t>();
  if (is(opcode, Opcode::kSchema)) {
    types_.emplace(id, plain_type(reader.text()));
  } else {
    channels_.emplace(id, channel_of(reader, types_));
  }
}

/// `in_file`: bytes of the record that are in the file.
void McapFile::take_chunk(std::uint64_t offset, std::uint64_t bytes, std::uint64_t in_file) {
  constexpr std::uint64_t kHead = 8 + 8 + 8 + 4;  // times, size, checksum
  constexpr std::uint64_t kLongestName = 64;
  const std::vector<std::uint8_t> head =
      content_at(offset, std::min(bytes, kHead + 4 + kLongestName + 8));
  ByteReader reader(head);
  ChunkPlace place;
  place.span.start_ns = read_time(reader);
  place.span.end_ns = read_time(reader);
  place.unpacked_bytes = reader.number<std::uint64_t>();
  place.crc = reader.number<std::uint32_t>();
  place.packing = reader.text();
  if (!is_packing_known(place.packing)) throw CutOff(0);

  const auto records = reader.number<std::uint64_t>();
  const std::uint64_t left = in_file - reader.at();
  place.offset = offset + reader.at();
  place.bytes = std::min(records, left);
  // A chunk that is completely in the file must contain all its records.
  place.is_cut_off = records > left && !remarks_.empty();
  if (records > left && !place.is_cut_off) throw CutOff(0);
  places_.push_back(std::move(place));
}

void McapFile::take_index(Bytes content) {
  if (places_.empty()) throw CutOff(0);
  ByteReader reader(content);
  const auto id = reader.number<std::uint16_t>();
  const auto bytes = reader.number<std::uint32_t>();
  constexpr std::uint32_t kEntryBytes = 16;
  if (bytes != reader.left() || bytes % kEntryBytes != 0) throw CutOff(0);
  places_.back().has_index = true;
  if (bytes > 0) places_.back().counts[id] += bytes / kEntryBytes;
}

void McapFile::take_statistics(Bytes content) {
  ByteReader reader(content);
  reader.take(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8);  // total counts, first and last time
  const auto bytes = reader.number<std::uint32_t>();
  constexpr std::uint32_t kEntryBytes = 10;
  for (std::uint32_t i = 0; i < bytes / kEntryBytes; ++i) {
    const auto id = reader.number<std::uint16_t>();
    stated_counts_[id] = reader.number<std::uint64_t>();
  }
}

/// A message outside of chunks: adjacent ones form a run, which is read like a chunk.
void McapFile::take_message(std::uint64_t offset, std::uint64_t bytes) {
  std::array<std::uint8_t, 2 + 4 + 8> head{};
  if (bytes < head.size() + 8 || !read(offset, head)) throw CutOff(0);
  ByteReader reader(head);
  const auto id = reader.number<std::uint16_t>();
  reader.take(4);
  const auto time = read_time(reader);

  const std::uint64_t begin = offset - mcap::kRecordHead;
  if (places_.empty() || run_end_ != begin || places_.back().bytes > kRunBytes) {
    ChunkPlace place;
    place.offset = begin;
    place.has_index = true;
    place.span = {time, time};
    places_.push_back(place);
  }

  ChunkPlace& run = places_.back();
  run_end_ = offset + bytes;
  run.bytes = run.unpacked_bytes = run_end_ - run.offset;
  run.span.start_ns = std::min(run.span.start_ns, time);
  run.span.end_ns = std::max(run.span.end_ns, time);
  ++run.counts[id];
}

void McapFile::read_records(Bytes records, ChunkContent& content) const {
  ByteReader reader(records);
  while (reader.left() > 0) {
    const auto opcode = reader.number<std::uint8_t>();
    const auto bytes = reader.number<std::uint64_t>();
    const std::size_t begin = reader.at();
    ByteReader record(reader.take(bytes));

    if (is(opcode, Opcode::kMessage)) {
      const auto id = record.number<std::uint16_t>();
      record.take(4);
      const auto time = read_time(record);
      record.take(8);
      content.entries.push_back({time, id, static_cast<std::uint32_t>(begin + record.at()),
                                 static_cast<std::uint32_t>(record.left())});
    } else if (is(opcode, Opcode::kSchema)) {
      const auto id = record.number<std::uint16_t>();
      types_.emplace(id, plain_type(record.text()));
    } else if (is(opcode, Opcode::kChannel)) {
      const auto id = record.number<std::uint16_t>();
      content.channels.emplace(id, channel_of(record, types_));
    }
  }
}

}  // namespace understory::bag
