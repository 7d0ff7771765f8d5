#include "common/mcap/writer.hpp"

#include <fmt/format.h>
#include <zlib.h>
#include <zstd.h>

#include <stdexcept>
#include <string_view>

#include "common/io/data_error.hpp"
#include "common/io/whole_file.hpp"
#include "common/mcap/encoder.hpp"

namespace understory::mcap {
namespace {

/// CRC-32 of the specification (that of zlib and PNG), continued from `crc`.
std::uint32_t crc_after(std::uint32_t crc, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      ::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string packed(std::string_view bytes) {
  std::string out(::ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ::ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 3);
  if (::ZSTD_isError(size) != 0U) throw io::DataError(::ZSTD_getErrorName(size));
  out.resize(size);
  return out;
}

}  // namespace

class Writer::Impl {
 public:
  Impl(const std::filesystem::path& path, const WriterOptions& options)
      : options_(options), file_(path) {
    Encoder out;
    out.raw(kMagic);
    Encoder header;
    header.text(options.profile);
    header.text(options.library);
    out.record(Opcode::kHeader, header.bytes());
    append(out.bytes());
  }

  std::uint16_t add(const Schema& schema) {
    schemas_.push_back({schema, false});
    return static_cast<std::uint16_t>(schemas_.size());
  }
  std::uint16_t add(const Channel& channel) {
    channels_.push_back({channel, false});
    return static_cast<std::uint16_t>(channels_.size());
  }

  void write(const Message& message) {
    introduce(message.channel_id);
    chunk_.time.take(message.log_time_ns, chunk_.indexes.empty());
    statistics_.time.take(message.log_time_ns, statistics_.message_count == 0);
    chunk_.indexes[message.channel_id].emplace_back(message.log_time_ns,
                                                    chunk_.records.bytes().size());
    ++statistics_.message_count;
    ++statistics_.channel_message_counts[message.channel_id];

    chunk_.records.head(Opcode::kMessage, 2 + 4 + 8 + 8 + message.data.size());
    chunk_.records.u16(message.channel_id);
    chunk_.records.u32(message.sequence);
    chunk_.records.u64(message.log_time_ns);
    chunk_.records.u64(message.publish_time_ns);
    chunk_.records.raw(message.data);
    if (chunk_.records.bytes().size() >= options_.chunk_bytes) end_chunk();
  }

  void commit() {
    if (!chunk_.indexes.empty()) end_chunk();
    Encoder crc;
    crc.u32(crc_);
    Encoder data_end;
    data_end.record(Opcode::kDataEnd, crc.bytes());
    append(data_end.bytes());
    append_summary();
    append(kMagic);
    file_.commit();
  }

  const Statistics& statistics() const { return statistics_; }

 private:
  /// The chunk being filled.
  struct OpenChunk {
    Encoder records;
    TimeSpan time;
    std::map<std::uint16_t, MessageIndex> indexes;  ///< Index by channel.
  };

  /// Written to the file at its first use.
  template <class T>
  struct Announced {
    T value;
    bool is_in_file = false;
  };

  /// Writes the channel and its schema before its first message.
  void introduce(std::uint16_t channel_id) {
    auto& channel = channels_.at(channel_id - std::size_t{1});
    if (channel.is_in_file) return;
    channel.is_in_file = true;
    ++statistics_.channel_count;

    if (const std::uint16_t id = channel.value.schema_id; id != 0) {
      auto& schema = schemas_.at(id - std::size_t{1});
      if (!schema.is_in_file) {
        schema.is_in_file = true;
        ++statistics_.schema_count;
        chunk_.records.record(Opcode::kSchema, content_of(id, schema.value));
      }
    }
    chunk_.records.record(Opcode::kChannel, content_of(channel_id, channel.value));
  }

  void end_chunk() {
    ChunkIndex index = append_chunk();
    for (const auto& [channel, places] : chunk_.indexes) {
      index.message_index_offsets[channel] = file_.size();
      Encoder record;
      record.record(Opcode::kMessageIndex, content_of(channel, places));
      append(record.bytes());
    }

    index.message_index_length = file_.size() - index.start - index.length;
    Encoder record;
    record.record(Opcode::kChunkIndex, content_of(index));
    chunk_indexes_ += record.bytes();
    ++statistics_.chunk_count;
    chunk_.records.clear();
    chunk_.indexes.clear();
  }

  ChunkIndex append_chunk() {
    const std::string& records = chunk_.records.bytes();
    const std::string content = options_.compresses ? packed(records) : records;
    const std::string_view compression = options_.compresses ? "zstd" : "";
    ChunkIndex index{chunk_.time,    file_.size(),  0, {}, 0, std::string(compression),
                     content.size(), records.size()};

    Encoder fields;
    fields.u64(index.time.start_ns);
    fields.u64(index.time.end_ns);
    fields.u64(records.size());
    fields.u32(crc_after(0, records));
    fields.text(compression);
    fields.u64(content.size());
    Encoder head;
    head.head(Opcode::kChunk, fields.bytes().size() + content.size());
    head.raw(fields.bytes());
    append(head.bytes());
    append(content);

    index.length = file_.size() - index.start;
    return index;
  }

  /// Writes schemas, channels, statistics and chunk indexes, the place of each group, and the
  /// footer.
  void append_summary() {
    Encoder schemas;
    for (std::size_t i = 0; i < schemas_.size(); ++i) {
      if (!schemas_[i].is_in_file) continue;
      const auto id = static_cast<std::uint16_t>(i + 1);
      schemas.record(Opcode::kSchema, content_of(id, schemas_[i].value));
    }
    Encoder channels;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      if (!channels_[i].is_in_file) continue;
      const auto id = static_cast<std::uint16_t>(i + 1);
      channels.record(Opcode::kChannel, content_of(id, channels_[i].value));
    }
    Encoder statistics;
    statistics.record(Opcode::kStatistics, content_of(statistics_));

    const std::uint64_t start = file_.size();
    crc_ = 0;
    Encoder offsets;
    append_group(Opcode::kSchema, schemas.bytes(), offsets);
    append_group(Opcode::kChannel, channels.bytes(), offsets);
    append_group(Opcode::kStatistics, statistics.bytes(), offsets);
    append_group(Opcode::kChunkIndex, chunk_indexes_, offsets);
    append_footer(start, offsets.bytes());
  }

  void append_group(Opcode opcode, std::string_view records, Encoder& offsets) {
    if (records.empty()) return;
    Encoder content;
    content.u8(static_cast<std::uint8_t>(opcode));
    content.u64(file_.size());
    content.u64(records.size());
    offsets.record(Opcode::kSummaryOffset, content.bytes());
    append(records);
  }

  /// Its CRC covers the summary, the offsets and the footer up to itself.
  void append_footer(std::uint64_t summary_start, std::string_view offsets) {
    const std::uint64_t offset_start = file_.size();
    append(offsets);
    Encoder footer;
    footer.head(Opcode::kFooter, 8 + 8 + 4);
    footer.u64(summary_start);
    footer.u64(offset_start);
    append(footer.bytes());
    Encoder crc;
    crc.u32(crc_);
    append(crc.bytes());
  }

  void append(std::string_view bytes) {
    crc_ = crc_after(crc_, bytes);
    file_.write(bytes);
  }

  WriterOptions options_;
  io::WholeFile file_;
  std::uint32_t crc_ = 0;  ///< CRC of the data section, then of the summary.
  std::vector<Announced<Schema>> schemas_;
  std::vector<Announced<Channel>> channels_;
  OpenChunk chunk_;
  std::string chunk_indexes_;  ///< As records of the summary.
  Statistics statistics_;
};

Writer::Writer(const std::filesystem::path& path, const WriterOptions& options)
    : impl_(std::make_unique<Impl>(path, options)) {}
Writer::~Writer() = default;

std::uint16_t Writer::add(const Schema& schema) { return impl_->add(schema); }
std::uint16_t Writer::add(const Channel& channel) { return impl_->add(channel); }
void Writer::write(const Message& message) { impl_->write(message); }
void Writer::commit() { impl_->commit(); }
const Statistics& Writer::statistics() const { return impl_->statistics(); }

}  // namespace understory::mcap
