#include "common/bag/ros1_bag.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <optional>

#include "common/bag/byte_reader.hpp"
#include "common/bag/unpack.hpp"
#include "common/io/data_error.hpp"

namespace understory::bag {
namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kMessageData = 0x02;
constexpr std::uint8_t kBagHeader = 0x03;
constexpr std::uint8_t kIndexData = 0x04;
constexpr std::uint8_t kChunk = 0x05;
constexpr std::uint8_t kChunkInfo = 0x06;
constexpr std::uint8_t kConnection = 0x07;
/// Largest header of a record [bytes]; a connection has its message definition in the data.
constexpr std::uint32_t kLargestHeader = 1U << 20U;
/// Largest data of a record other than a chunk [bytes].
constexpr std::uint64_t kLargestData = 64U << 20U;

/// The fields "name=value" of a record's header.
class Fields {
 public:
  /// Throws CutOff where a field's length is not possible.
  explicit Fields(Bytes header) {
    ByteReader reader(header);
    while (reader.left() > 0) {
      const std::size_t begin = reader.at();
      const std::string_view field = reader.text();
      const std::size_t equals = field.find('=');
      if (equals == std::string_view::npos) throw CutOff(begin);
      fields_.emplace(field.substr(0, equals), field.substr(equals + 1));
    }
  }

  template <class T>
  std::optional<T> number(std::string_view name) const {
    const auto found = fields_.find(name);
    if (found == fields_.end() || found->second.size() != sizeof(T)) return std::nullopt;
    T value{};
    std::memcpy(&value, found->second.data(), sizeof(T));
    return value;
  }

  std::string text(std::string_view name) const {
    const auto found = fields_.find(name);
    return found == fields_.end() ? std::string() : std::string(found->second);
  }

 private:
  std::map<std::string_view, std::string_view> fields_;
};

/// Seconds in the lower half, nanoseconds in the upper one.
std::int64_t time_ns(std::uint64_t stamp) {
  return static_cast<std::int64_t>(stamp & 0xffffffffU) * 1'000'000'000 +
         static_cast<std::int64_t>(stamp >> 32U);
}

ChannelInfo connection_of(const Fields& header, Bytes data) {
  const Fields fields(data);
  // The header has the recorded topic, the data has the publisher's topic.
  return {header.text("topic"), plain_type(fields.text("type")), "ros1"};
}

}  // namespace

/// Header of a record; the data is not read.
struct Ros1Bag::Record {
  std::vector<std::uint8_t> header;
  std::uint64_t offset = 0;  ///< Offset of the record.
  std::uint64_t data = 0;    ///< Offset of its data.
  std::uint64_t data_bytes = 0;
  bool is_cut_off = false;  ///< The file ends in the data.
};

Ros1Bag::Ros1Bag(const std::filesystem::path& path) : ChunkedBag(path) {
  walk();
  if (!is_closed_ && remarks_.empty())
    remarks_.push_back(source_ + ": was not closed by its recorder: read without its index");
  finish_opening();
}

/// Returns false at the end of the file and where no record is possible: reading stops there.
bool Ros1Bag::read_record(std::uint64_t offset, Record& record) {
  record = {};
  record.offset = offset;
  if (offset == size()) return false;
  std::uint32_t length = 0;
  const auto word = [&](std::uint64_t at) {
    return read(at, {reinterpret_cast<std::uint8_t*>(&length), sizeof length});
  };

  if (!word(offset)) {
    stop_at(offset, "cut off");
    return false;
  }

  if (length > kLargestHeader || length == 0) {
    stop_at(offset, "no record");
    return false;
  }

  if (length > size() - offset - sizeof length) {
    stop_at(offset, "cut off");
    return false;
  }

  record.header.resize(length);
  record.data = offset + 2 * sizeof length + record.header.size();
  if (!read(offset + sizeof length, record.header) || !word(record.data - sizeof length)) {
    stop_at(offset, "cut off");
    return false;
  }

  record.data_bytes = length;
  record.is_cut_off = record.data_bytes > size() - record.data;
  if (record.is_cut_off) {
    stop_at(offset, "cut off");
    record.data_bytes = size() - record.data;
  }
  return true;
}

void Ros1Bag::walk() {
  std::uint64_t offset = kRos1Magic.size();
  Record record;
  while (read_record(offset, record)) {
    try {
      take(record);
    } catch (const CutOff&) {
      stop_at(offset, "damaged");
      break;
    }
    if (record.is_cut_off) break;
    offset = record.data + record.data_bytes;
  }
  distrust_last_index();
}

std::vector<std::uint8_t> Ros1Bag::data_of(const Record& record) {
  if (record.data_bytes > kLargestData) throw CutOff(0);
  std::vector<std::uint8_t> data(record.data_bytes);
  if (!read(record.data, data)) throw CutOff(0);
  return data;
}

void Ros1Bag::take(const Record& record) {
  const Fields fields(record.header);
  const auto op = fields.number<std::uint8_t>("op");
  if (!op || *op < kMessageData || *op > kConnection) throw CutOff(0);
  if (*op == kChunk) return take_chunk(record);
  if (record.is_cut_off) return;

  if (*op == kBagHeader) {
    is_closed_ = fields.number<std::uint64_t>("index_pos").value_or(0) != 0;
    const std::string encryptor = fields.text("encryptor");
    if (!encryptor.empty()) refuse(record.offset, "encrypted with " + encryptor);
  } else if (*op == kIndexData) {
    take_index(record);
  } else if (*op == kConnection) {
    const std::vector<std::uint8_t> data = data_of(record);
    const auto id = fields.number<std::uint32_t>("conn");
    if (!id) throw CutOff(0);
    channels_.emplace(*id, connection_of(fields, data));
  }
}

void Ros1Bag::take_chunk(const Record& record) {
  const Fields fields(record.header);
  const auto unpacked = fields.number<std::uint32_t>("size");
  ChunkPlace place;
  place.packing = fields.text("compression");
  if (!unpacked || !is_packing_known(place.packing)) throw CutOff(0);
  place.offset = record.data;
  place.bytes = record.data_bytes;
  place.unpacked_bytes = *unpacked;
  place.is_cut_off = record.is_cut_off;
  places_.push_back(std::move(place));
}

/// Reads the times of one connection's messages in the preceding chunk.
void Ros1Bag::take_index(const Record& record) {
  const Fields fields(record.header);
  const auto id = fields.number<std::uint32_t>("conn");
  const auto count = fields.number<std::uint32_t>("count");
  constexpr std::size_t kEntryBytes = 12;
  if (!id || !count || places_.empty() || record.data_bytes / kEntryBytes != *count)
    throw CutOff(0);

  ChunkPlace& place = places_.back();
  const std::vector<std::uint8_t> data = data_of(record);
  ByteReader reader(data);
  for (std::uint32_t i = 0; i < *count; ++i) {
    const std::int64_t time = time_ns(reader.number<std::uint64_t>());
    reader.take(4);
    place.span.start_ns = place.has_index ? std::min(place.span.start_ns, time) : time;
    place.span.end_ns = place.has_index ? std::max(place.span.end_ns, time) : time;
    place.has_index = true;
  }
  if (*count > 0) place.counts[*id] += *count;
}

void Ros1Bag::read_records(Bytes records, ChunkContent& content) const {
  ByteReader reader(records);
  while (reader.left() > 0) {
    const std::string_view head = reader.text();
    const Fields fields({reinterpret_cast<const std::uint8_t*>(head.data()), head.size()});
    const std::string_view data = reader.text();
    const auto op = fields.number<std::uint8_t>("op");
    const auto id = fields.number<std::uint32_t>("conn");
    if (!op || !id) throw CutOff(reader.at());

    if (*op == kConnection) {
      const Bytes bytes{reinterpret_cast<const std::uint8_t*>(data.data()), data.size()};
      content.channels.emplace(*id, connection_of(fields, bytes));
    } else if (*op == kMessageData) {
      const auto time = fields.number<std::uint64_t>("time");
      if (!time) throw CutOff(reader.at());
      content.entries.push_back({time_ns(*time), *id,
                                 static_cast<std::uint32_t>(reader.at() - data.size()),
                                 static_cast<std::uint32_t>(data.size())});
    }
  }
}

}  // namespace understory::bag
