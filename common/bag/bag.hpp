// Recorded messages of ROS in their containers: ROS 1 bags, ROS 2 bags (SQLite), MCAP.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace understory::bag {

/// Serialisation of a message's fields.
enum class Encoding : std::uint8_t {
  kRos1,   ///< Little-endian, packed.
  kCdr,    ///< ROS 2: aligned, either byte order.
  kOther,  ///< Another encoding: such topics are listed but not read.
};

/// A stream of messages of one type.
struct Topic {
  std::string name;                            ///< For example /points.
  std::string type;                            ///< For example sensor_msgs/PointCloud2.
  Encoding encoding = Encoding::kOther;        ///< Encoding of its messages.
  std::string encoding_name;                   ///< Name of the encoding in the file.
  std::optional<std::uint64_t> messages = {};  ///< Number of messages if the file states it.

  /// Whether it is the same stream.
  bool is_same(const Topic& other) const {
    return name == other.name && type == other.type && encoding == other.encoding;
  }
};

/// One recorded message.
struct Message {
  std::size_t topic = 0;               ///< Index in Bag::topics().
  std::int64_t received_ns = 0;        ///< Reception time of the recorder [ns since the epoch].
  std::span<const std::uint8_t> data;  ///< Valid until the next call of next() or rewind().
};

/// A recording, read in order of reception time.
class Bag {
 public:
  Bag() = default;
  virtual ~Bag() = default;
  Bag(const Bag&) = delete;
  Bag& operator=(const Bag&) = delete;

  /// All topics; known after opening.
  virtual const std::vector<Topic>& topics() const = 0;
  /// The next message of the selected topics, or none at the end. Throws io::DataError with the
  /// file and the place of damaged data.
  virtual std::optional<Message> next() = 0;
  /// Restarts with these topics alone (indices in topics()); empty = all.
  virtual void rewind(const std::vector<std::size_t>& wanted = {}) = 0;
  /// Remarks for people (cut off, not closed, files joined): one line each, with the file.
  virtual std::vector<std::string> remarks() const = 0;
  /// Kind of container: "ROS 1 bag", "ROS 2 bag (SQLite)", "MCAP".
  virtual std::string kind() const = 0;
};

/// Opens a file (.bag, .db3, .mcap; found by content) or a folder with the files of one recording,
/// which are joined in order of time. Memory: an index of the chunks and the unpacked chunks that
/// overlap in time, at most kMostUnpackedBytes unless one alone is larger. Throws io::DataError
/// with the file and its fault.
std::unique_ptr<Bag> open_bag(const std::filesystem::path& path);

/// "sensor_msgs/msg/PointCloud2" and "sensor_msgs/PointCloud2" are one type: the latter.
std::string plain_type(std::string_view type);
/// Encoding by its name in MCAP and SQLite bags: "ros1", "cdr"; any other is kOther.
Encoding encoding_of(std::string_view name);

/// A time within 146 years of 1970: a time beyond is damage and becomes the limit. Differences of
/// such times and of stamps fit into 64 bits.
std::int64_t bounded_time(std::int64_t time_ns);

constexpr std::size_t kMostUnpackedBytes = 256U << 20U;

}  // namespace understory::bag
