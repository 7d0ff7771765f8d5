// Messages of a file of chunks in order of time, with a bounded number of unpacked chunks.
#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <queue>
#include <span>
#include <vector>

namespace understory::bag {

/// One message in an unpacked chunk.
struct ChunkEntry {
  std::int64_t time_ns = 0;
  std::uint32_t channel = 0;  ///< Number of the channel or connection in the file.
  std::uint32_t offset = 0;   ///< Offset of the message's data in the chunk.
  std::uint32_t size = 0;     ///< Size of the message's data.
};

/// A chunk in memory.
struct LoadedChunk {
  std::vector<std::uint8_t> bytes;
  std::vector<ChunkEntry> entries;  ///< In any order.
};

/// Earliest and latest time in a chunk [ns].
struct ChunkSpan {
  std::int64_t start_ns = 0;
  std::int64_t end_ns = 0;
};

/// Merges chunks whose times may overlap. A chunk is loaded when its earliest time is due and freed
/// after its last message; where more than `most_bytes` would be in memory, the chunk whose next
/// message is the latest is freed and loaded again when it is due.
class ChunkOrder {
 public:
  /// Loads a chunk by its number; may throw.
  using Load = std::function<LoadedChunk(std::size_t chunk)>;
  /// Whether entries of a channel are wanted.
  using IsWanted = std::function<bool(std::uint32_t channel)>;

  /// `spans`: time span of every chunk, by its number.
  ChunkOrder(std::vector<ChunkSpan> spans, Load load, IsWanted is_wanted, std::size_t most_bytes);

  /// A message and its bytes, which are valid until the next call.
  struct Item {
    ChunkEntry entry;
    std::span<const std::uint8_t> data;
  };
  /// The next message in order of time; messages of equal time in order of chunks and entries.
  /// Passes on exceptions of `load`.
  std::optional<Item> next();
  /// Number of loads of chunks.
  std::uint64_t loads() const { return loads_; }

 private:
  /// A chunk with remaining messages.
  struct Open {
    std::size_t number = 0;
    std::size_t next = 0;  ///< Index of the next entry.
    LoadedChunk chunk;     ///< Its bytes are empty while it is not loaded.
    bool is_loaded = true;
  };
  using Key = std::pair<std::int64_t, std::size_t>;  ///< Time of the next message, chunk.

  void open_due();
  void load(Open& open);
  void make_room();

  std::vector<ChunkSpan> spans_;
  Load load_;
  IsWanted is_wanted_;
  std::size_t most_bytes_;
  std::vector<std::size_t> order_;  ///< Chunks by their earliest time.
  std::size_t next_chunk_ = 0;      ///< Index in order_.
  std::map<Key, Open> open_;
  std::optional<Open> given_;  ///< Exhausted chunk whose last message was just returned.
  std::size_t bytes_ = 0;
  std::uint64_t loads_ = 0;
};

}  // namespace understory::bag
