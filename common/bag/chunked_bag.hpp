// What ROS 1 bags and MCAP files have in common: chunks of records, and topics by number.
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

/// Where a chunk is and what the file says of it.
struct ChunkPlace {
  std::uint64_t offset = 0;  ///< Of its packed records in the file [bytes].
  std::uint64_t bytes = 0;   ///< Packed, as far as the file has them.
  std::uint64_t unpacked_bytes = 0;
  std::uint32_t crc = 0;  ///< Of the unpacked records; 0 = not known.
  std::string packing;
  bool is_cut_off = false;  ///< The file ends in it: what is there is read.
  bool has_index = false;   ///< `counts` and `span` are known.
  ChunkSpan span;
  std::map<std::uint32_t, std::uint64_t> counts;  ///< Messages by channel.
};

/// What the file says of one channel (MCAP) or connection (ROS 1).
struct ChannelInfo {
  std::string topic;
  std::string type;      ///< Plain.
  std::string encoding;  ///< As the file calls it.
};

/// The records of a chunk: its messages and the channels that are declared in it.
struct ChunkContent {
  std::vector<ChunkEntry> entries;
  std::map<std::uint32_t, ChannelInfo> channels;
};

/// A file of chunks. The format is a class of its own that finds the chunks and reads records.
class ChunkedBag : public Bag {
 public:
  const std::vector<Topic>& topics() const override { return topics_; }
  std::optional<Message> next() override;
  void rewind(const std::vector<std::size_t>& wanted) override;
  std::vector<std::string> remarks() const override { return remarks_; }

 protected:
  /// Throws io::DataError where it cannot be opened.
  explicit ChunkedBag(const std::filesystem::path& path);

  /// Records of an unpacked chunk, in order. Throws CutOff where they end in the middle; what was
  /// found before is in `content`.
  virtual void read_records(std::span<const std::uint8_t> records, ChunkContent& content) const = 0;

  /// To be called when `places_` and `channels_` are complete as far as the file's structure goes:
  /// looks into chunks that have no index or channels that nothing declares, and lists the topics.
  void finish_opening();
  /// Fills `out` from the file; false when it ends before. Throws io::DataError.
  bool read(std::uint64_t offset, std::span<std::uint8_t> out);
  /// Ends the walk through the file here and says so.
  void stop_at(std::uint64_t offset, const std::string& why);
  /// Where the walk ended early the last chunk's index may lack entries: it is looked into.
  void distrust_last_index();
  /// "FILE: byte 123: what"
  [[noreturn]] void refuse(std::uint64_t offset, const std::string& what) const;
  std::uint64_t size() const { return file_.size(); }  ///< Of the file [bytes].

  std::vector<ChunkPlace> places_;
  std::map<std::uint32_t, ChannelInfo> channels_;
  std::map<std::uint32_t, std::uint64_t> stated_counts_;  ///< Of the whole file, where it has them.
  std::vector<std::string> remarks_;
  std::string source_;

 private:
  LoadedChunk load(std::size_t number, ChunkContent& content);
  void look_into(std::size_t number);
  bool is_declared(const ChunkPlace& place) const;
  void list_topics();

  io::FileWindow file_;
  std::vector<Topic> topics_;
  std::map<std::uint32_t, std::size_t> topic_of_;  ///< By channel.
  std::set<std::size_t> wanted_;                   ///< Topics; empty = all.
  std::unique_ptr<ChunkOrder> order_;
};

}  // namespace understory::bag
