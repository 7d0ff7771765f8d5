#include "tests/mcap/mcap_reader.hpp"

#include <zlib.h>
#include <zstd.h>

#include <fstream>
#include <iterator>
#include <stdexcept>

#include "common/mcap/encoder.hpp"

namespace understory::test {
namespace {

using mcap::Opcode;

void require(bool holds, const std::string& what) {
  if (!holds) throw std::runtime_error(what);
}

std::uint32_t crc_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      ::crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

/// Reads values from the front of bytes.
class Decoder {
 public:
  explicit Decoder(std::string_view bytes) : rest_(bytes) {}
  std::uint64_t integer(std::size_t size) {
    const std::string_view bytes = raw(size);
    std::uint64_t value = 0;
    for (std::size_t i = size; i-- > 0;) value = value << 8U | static_cast<unsigned char>(bytes[i]);
    return value;
  }
  std::uint16_t u16() { return static_cast<std::uint16_t>(integer(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(integer(4)); }
  std::uint64_t u64() { return integer(8); }
  std::string text() { return std::string(raw(u32())); }
  std::string_view raw(std::size_t size) {
    require(size <= rest_.size(), "cut");
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }
  std::map<std::uint16_t, std::uint64_t> counts() {
    Decoder entries(raw(u32()));
    std::map<std::uint16_t, std::uint64_t> result;
    while (!entries.rest().empty()) {
      const std::uint16_t key = entries.u16();
      result[key] = entries.u64();
    }
    return result;
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

struct Record {
  Opcode opcode = Opcode::kHeader;
  std::string_view content;
  std::size_t start = 0;  ///< In the bytes that it was read from.
  std::size_t length = 0;
};

std::vector<Record> records_of(std::string_view bytes, std::size_t offset) {
  std::vector<Record> result;
  Decoder in(bytes);
  while (!in.rest().empty()) {
    const std::size_t start = offset + bytes.size() - in.rest().size();
    const auto opcode = static_cast<Opcode>(in.integer(1));
    const std::string_view content = in.raw(in.u64());
    result.push_back({opcode, content, start, mcap::kRecordHead + content.size()});
  }
  return result;
}

std::string unpacked(std::string_view bytes, const std::string& compression, std::size_t size) {
  if (compression.empty()) return std::string(bytes);
  require(compression == "zstd", "compression " + compression);
  std::string out(size, '\0');
  require(::ZSTD_decompress(out.data(), size, bytes.data(), bytes.size()) == size, "zstd");
  return out;
}

class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  McapFile read() {
    const std::size_t magic = mcap::kMagic.size();
    require(bytes_.substr(0, magic) == mcap::kMagic, "no magic in front");
    require(bytes_.size() > 2 * magic && bytes_.ends_with(mcap::kMagic), "no magic at the end");
    all_ = records_of(bytes_.substr(magic, bytes_.size() - 2 * magic), magic);
    std::size_t next = data_section();
    while (all_.at(next).opcode != Opcode::kFooter) summary(all_[next++]);
    footer(all_[next]);
    require(next + 1 == all_.size(), "records behind the footer");
    require(indexes_seen_ == file_.chunks, "chunks without an index");
    require(statistics_seen_ == 1, "statistics");
    return std::move(file_);
  }

 private:
  std::size_t data_section() {
    Decoder header(all_.at(0).content);
    require(all_[0].opcode == Opcode::kHeader, "no header");
    file_.profile = header.text();
    file_.library = header.text();

    std::size_t i = 1;
    for (; all_.at(i).opcode != Opcode::kDataEnd; ++i) {
      if (all_[i].opcode == Opcode::kChunk) {
        chunk(all_[i]);
      } else {
        require(all_[i].opcode == Opcode::kMessageIndex, "record in the data section");
        message_index(all_[i]);
      }
    }
    Decoder end(all_[i].content);
    require(end.u32() == crc_of(bytes_.substr(0, all_[i].start)), "CRC of the data section");
    return i + 1;
  }

  void chunk(const Record& record) {
    Decoder in(record.content);
    const std::uint64_t start = in.u64();
    const std::uint64_t end = in.u64();
    const std::uint64_t size = in.u64();
    const std::uint32_t crc = in.u32();
    const std::string compression = in.text();
    const std::string_view packed = in.raw(in.u64());
    const std::string records = unpacked(packed, compression, size);
    require(crc == crc_of(records), "CRC of a chunk");
    require(records.size() == size && in.rest().empty(), "size of a chunk");

    ++file_.chunks;
    last_chunk_ = &record;
    places_.clear();
    for (const Record& one : records_of(records, 0)) in_chunk(one);
    for (const auto& [place, message] : places_) {
      require(start <= message.log_time && message.log_time <= end, "time span of a chunk");
    }
  }

  void in_chunk(const Record& record) {
    Decoder in(record.content);
    if (record.opcode == Opcode::kSchema) {
      const std::uint16_t id = in.u16();
      require(id != 0, "schema 0");
      file_.schemas[id] = in.text();
    } else if (record.opcode == Opcode::kChannel) {
      const std::uint16_t id = in.u16();
      McapChannel& channel = file_.channels[id];
      channel.schema = in.u16();
      require(channel.schema == 0 || file_.schemas.contains(channel.schema), "schema of a channel");
      channel.topic = in.text();
      channel.encoding = in.text();
    } else {
      require(record.opcode == Opcode::kMessage, "record in a chunk");
      McapMessage message{in.u16(), in.u32(), in.u64(), in.u64(), std::string(in.rest())};
      require(file_.channels.contains(message.channel), "channel of a message");
      places_[record.start] = message;
      file_.messages.push_back(std::move(message));
    }
  }

  void message_index(const Record& record) {
    require(last_chunk_ != nullptr, "message index without a chunk");
    Decoder in(record.content);
    const std::uint16_t channel = in.u16();
    Decoder entries(in.raw(in.u32()));
    std::size_t seen = 0;
    for (; !entries.rest().empty(); ++seen) {
      const std::uint64_t time = entries.u64();
      const auto found = places_.find(entries.u64());
      require(found != places_.end(), "offset of a message");
      require(found->second.channel == channel && found->second.log_time == time,
              "message at an offset");
    }
    std::size_t there = 0;
    for (const auto& [place, message] : places_) there += message.channel == channel ? 1 : 0;
    require(seen == there, "messages without an index");
    index_starts_[last_chunk_->start][channel] = record.start;
    index_bytes_[last_chunk_->start] += record.length;
  }

  void summary(const Record& record) {
    if (summary_start_ == 0) summary_start_ = record.start;
    Decoder in(record.content);
    if (record.opcode == Opcode::kSchema) {
      require(file_.schemas.contains(in.u16()), "schema of the summary");
    } else if (record.opcode == Opcode::kChannel) {
      require(file_.channels.contains(in.u16()), "channel of the summary");
    } else if (record.opcode == Opcode::kChunkIndex) {
      chunk_index(in);
    } else if (record.opcode == Opcode::kStatistics) {
      statistics(in);
    } else {
      require(record.opcode == Opcode::kSummaryOffset, "record in the summary");
      if (offsets_start_ == 0) offsets_start_ = record.start;
      summary_offset(in);
      return;
    }
    group_bytes_[record.opcode] += record.length;
    group_starts_.try_emplace(record.opcode, record.start);
  }

  void chunk_index(Decoder in) {
    ++indexes_seen_;
    in.raw(16);
    const std::uint64_t start = in.u64();
    const std::uint64_t length = in.u64();
    require(index_starts_.contains(start), "place of a chunk");
    require(in.counts() == index_starts_.at(start), "places of message indexes");
    require(in.u64() == index_bytes_.at(start), "size of message indexes");
    const auto chunk = records_of(bytes_.substr(start, length), start);
    require(chunk.size() == 1 && chunk[0].opcode == Opcode::kChunk, "chunk at its place");
    Decoder there(chunk[0].content);
    there.raw(16);
    const std::uint64_t size = there.u64();
    there.u32();
    require(in.text() == there.text() && in.u64() == there.u64() && in.u64() == size,
            "sizes of a chunk");
  }

  void statistics(Decoder in) {
    ++statistics_seen_;
    require(in.u64() == file_.messages.size(), "number of messages");
    require(in.u16() == file_.schemas.size(), "number of schemas");
    require(in.u32() == file_.channels.size(), "number of channels");
    require(in.u32() == 0 && in.u32() == 0, "attachments");
    require(in.u32() == file_.chunks, "number of chunks");
    std::uint64_t start = file_.messages.empty() ? 0 : file_.messages.front().log_time;
    std::uint64_t end = 0;
    std::map<std::uint16_t, std::uint64_t> counts;
    for (const McapMessage& message : file_.messages) {
      start = std::min(start, message.log_time);
      end = std::max(end, message.log_time);
      ++counts[message.channel];
    }
    require(in.u64() == start && in.u64() == end, "time span");
    require(in.counts() == counts, "messages of each channel");
  }

  void summary_offset(Decoder in) {
    const auto opcode = static_cast<Opcode>(in.integer(1));
    require(in.u64() == group_starts_.at(opcode), "start of a group");
    require(in.u64() == group_bytes_.at(opcode), "length of a group");
    ++groups_seen_;
  }

  void footer(const Record& record) {
    Decoder in(record.content);
    require(in.u64() == summary_start_, "start of the summary");
    require(in.u64() == offsets_start_, "start of the offsets");
    const std::size_t covered = record.start + mcap::kRecordHead + 16 - summary_start_;
    require(in.u32() == crc_of(bytes_.substr(summary_start_, covered)), "CRC of the summary");
    require(groups_seen_ == group_starts_.size(), "groups without an offset");
  }

  std::string_view bytes_;
  std::vector<Record> all_;
  McapFile file_;
  const Record* last_chunk_ = nullptr;
  std::map<std::size_t, McapMessage> places_;  ///< Of the last chunk, by offset.
  std::map<std::size_t, std::map<std::uint16_t, std::uint64_t>> index_starts_;  ///< By chunk.
  std::map<std::size_t, std::uint64_t> index_bytes_;
  std::map<Opcode, std::uint64_t> group_starts_;
  std::map<Opcode, std::uint64_t> group_bytes_;
  std::size_t summary_start_ = 0;
  std::size_t offsets_start_ = 0;
  std::size_t indexes_seen_ = 0;
  std::size_t statistics_seen_ = 0;
  std::size_t groups_seen_ = 0;
};

}  // namespace

McapFile read_mcap(std::string_view bytes) { return Reader(bytes).read(); }

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace understory::test
