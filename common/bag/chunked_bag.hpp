// Common part of ROS 1 bags and MCAP files: chunks of records, and topics by number.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "common/bag/bag.hpp"
#include "common/bag/chunk_order.hpp"
#include "common/io/file_window.hpp"

namespace understory::bag {

/// Place of a chunk, and the file's information about it.
struct ChunkPlace {
  std::uint64_t offset = 0;  ///< Offset of its packed records in the file [bytes].
  std::uint64_t bytes = 0;   ///< Packed size, as far as the file contains it.
  std::uint64_t unpacked_bytes = 0;
  std::uint32_t crc = 0;  ///< Checksum of the unpacked records; 0 = not known.
  std::string packing;
  bool is_cut_off = false;  ///< The file ends in this chunk: the existing part is read.
  bool has_index = false;   ///< `counts` and `span` are known.
  ChunkSpan span;
  std::map<std::uint32_t, std::uint64_t> counts;  ///< Messages by channel.
};

/// The file's information about one channel (MCAP) or connection (ROS 1).
struct ChannelInfo {
  std::string topic;
  std::string type;      ///< As from plain_type().
  std::string encoding;  ///< Name in the file.
};

/// The records of a chunk: its messages and the channels that are declared in it.
struct ChunkContent {
  std::vector<ChunkEntry> entries;
  std::map<std::uint32_t, ChannelInfo> channels;
};

/// A file of chunks. A derived class for each format finds the chunks and reads records.
class ChunkedBag : public Bag {
 public:
  const std::vector<Topic>& topics() const override { return topics_; }
  std::optional<Message> next() override;
  void rewind(const std::vector<std::size_t>& wanted) override;
  std::vector<std::string> remarks() const override { return remarks_; }

 protected:
  /// Throws io::DataError where it cannot be opened.
  explicit ChunkedBag(const std::filesystem::path& path);

  /// Reads the records of an unpacked chunk in order. Throws CutOff where they are incomplete;
  /// `content` then has the records before.
  virtual void read_records(std::span<const std::uint8_t> records, ChunkContent& content) const = 0;

  /// Call it when `places_` and `channels_` contain all that the file's structure states: reads
  /// chunks without index and chunks with undeclared channels, and lists the topics.
  void finish_opening();
  /// Fills `out` from the file; false when the file is shorter. Throws io::DataError.
  bool read(std::uint64_t offset, std::span<std::uint8_t> out);
  /// Stops reading the file here and adds a remark.
  void stop_at(std::uint64_t offset, const std::string& why);
  /// If reading stopped early, the last chunk's index may lack entries: the chunk itself is read.
  void distrust_last_index();
  /// "FILE: byte 123: what"
  [[noreturn]] void refuse(std::uint64_t offset, const std::string& what) const;
  std::uint64_t size() const { return file_.size(); }  ///< Size of the file [bytes].

  std::vector<ChunkPlace> places_;
  std::map<std::uint32_t, ChannelInfo> channels_;
  std::map<std::uint32_t, std::uint64_t>
      stated_counts_;  ///< Counts that the file states for itself.
  std::vector<std::string> remarks_;
  std::string source_;

 private:
  LoadedChunk load(std::size_t number, ChunkContent& content);
  void look_into(std::size_t number);
  bool is_declared(const ChunkPlace& place) const;
  void list_topics();

  io::FileWindow file_;
  std::vector<Topic> topics_;
  std::map<std::uint32_t, std::size_t> topic_of_;  ///< Topic by channel.
  std::set<std::size_t> wanted_;                   ///< Selected topics; empty = all.
  std::unique_ptr<ChunkOrder> order_;
};

}  // namespace understory::bag
