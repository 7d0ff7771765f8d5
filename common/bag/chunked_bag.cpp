#include "common/bag/chunked_bag.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>

#include "common/bag/byte_reader.hpp"
#include "common/bag/unpack.hpp"
#include "common/io/data_error.hpp"
#include "common/io/lcm_log.hpp"

namespace understory::bag {

ChunkedBag::ChunkedBag(const std::filesystem::path& path) : source_(path.string()), file_(path) {}

void ChunkedBag::refuse(std::uint64_t offset, const std::string& what) const {
  throw io::DataError(fmt::format("{}: byte {}: {}", source_, offset, what));
}

bool ChunkedBag::read(std::uint64_t offset, std::span<std::uint8_t> out) {
  return file_.read(offset, out);
}

void ChunkedBag::stop_at(std::uint64_t offset, const std::string& why) {
  remarks_.push_back(
      fmt::format("{}: {} at byte {} of {}: what is before is read", source_, why, offset, size()));
}

void ChunkedBag::distrust_last_index() {
  if (remarks_.empty() || places_.empty()) return;
  places_.back().has_index = false;
  places_.back().counts.clear();
  stated_counts_.clear();
}

LoadedChunk ChunkedBag::load(std::size_t number, ChunkContent& content) {
  const ChunkPlace& place = places_[number];
  if (place.bytes > kLargestChunk)
    refuse(place.offset, fmt::format("a chunk of {} bytes", place.bytes));
  std::vector<std::uint8_t> packed(place.bytes);
  if (!read(place.offset, packed)) refuse(place.offset, "the file became shorter");

  LoadedChunk loaded;
  const bool is_packed = !place.packing.empty() && place.packing != "none";
  if (is_packed) {
    Unpacked unpacked = unpack(place.packing, packed, place.unpacked_bytes);
    if (unpacked.fault && !place.is_cut_off)
      refuse(place.offset, "a damaged chunk: " + *unpacked.fault);
    loaded.bytes = std::move(unpacked.bytes);
  } else {
    loaded.bytes = std::move(packed);
  }

  const bool is_checked = place.crc != 0 && !place.is_cut_off;
  if (is_checked && crc32_z(0, loaded.bytes.data(), loaded.bytes.size()) != place.crc)
    refuse(place.offset, "a damaged chunk: its checksum is another one");

  try {
    read_records(loaded.bytes, content);
  } catch (const CutOff& cut) {
    if (!place.is_cut_off)
      refuse(place.offset, fmt::format("a damaged chunk: a record ends in the middle, {} bytes "
                                       "behind the chunk's begin",
                                       cut.at()));
  }
  loaded.entries = content.entries;
  return loaded;
}

void ChunkedBag::look_into(std::size_t number) {
  ChunkContent content;
  load(number, content);
  for (auto& [id, channel] : content.channels) channels_.emplace(id, std::move(channel));
  ChunkPlace& place = places_[number];
  if (place.has_index) return;

  for (const ChunkEntry& entry : content.entries) {
    const bool is_first = place.counts.empty();
    place.span.start_ns = is_first ? entry.time_ns : std::min(place.span.start_ns, entry.time_ns);
    place.span.end_ns = is_first ? entry.time_ns : std::max(place.span.end_ns, entry.time_ns);
    ++place.counts[entry.channel];
  }
  place.has_index = true;
}

bool ChunkedBag::is_declared(const ChunkPlace& place) const {
  return std::ranges::all_of(place.counts,
                             [&](const auto& count) { return channels_.contains(count.first); });
}

void ChunkedBag::list_topics() {
  for (const auto& [id, channel] : channels_) {
    Topic topic{channel.topic, channel.type, encoding_of(channel.encoding), channel.encoding};
    const auto same =
        std::ranges::find_if(topics_, [&](const Topic& t) { return t.is_same(topic); });
    topic_of_[id] = static_cast<std::size_t>(same - topics_.begin());
    if (same == topics_.end()) topics_.push_back(std::move(topic));
  }

  std::map<std::uint32_t, std::uint64_t> counts = stated_counts_;
  if (counts.empty()) {
    for (const ChunkPlace& place : places_) {
      for (const auto& [id, count] : place.counts) counts[id] += count;
    }
  }
  for (Topic& topic : topics_) topic.messages = 0;
  for (const auto& [id, count] : counts) {
    if (const auto topic = topic_of_.find(id); topic != topic_of_.end())
      *topics_[topic->second].messages += count;
  }
}

void ChunkedBag::finish_opening() {
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (!places_[i].has_index || !is_declared(places_[i])) look_into(i);
  }
  list_topics();
  rewind({});
}

void ChunkedBag::rewind(const std::vector<std::size_t>& wanted) {
  wanted_ = {wanted.begin(), wanted.end()};
  const auto is_wanted = [this](std::uint32_t channel) {
    const auto topic = topic_of_.find(channel);
    return topic != topic_of_.end() && (wanted_.empty() || wanted_.contains(topic->second));
  };
  // A chunk without selected messages is not unpacked.
  std::vector<std::size_t> numbers;
  std::vector<ChunkSpan> spans;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const auto& counts = places_[i].counts;
    if (std::ranges::none_of(counts, [&](const auto& count) { return is_wanted(count.first); }))
      continue;
    numbers.push_back(i);
    spans.push_back(places_[i].span);
  }

  order_ = std::make_unique<ChunkOrder>(
      std::move(spans),
      [this, numbers = std::move(numbers)](std::size_t chunk) {
        ChunkContent content;
        return load(numbers[chunk], content);
      },
      is_wanted, kMostUnpackedBytes);
}

std::optional<Message> ChunkedBag::next() {
  const auto item = order_->next();
  if (!item) return std::nullopt;
  return Message{topic_of_.at(item->entry.channel), item->entry.time_ns, item->data};
}

}  // namespace understory::bag
