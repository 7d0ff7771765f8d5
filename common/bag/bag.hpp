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

/// How the fields of a message lie in its bytes.
enum class Encoding : std::uint8_t {
  kRos1,   ///< Little-endian, packed.
  kCdr,    ///< ROS 2: aligned, either byte order.
  kOther,  ///< Another one: such topics are listed and not read.
};

/// A stream of messages of one type.
struct Topic {
  std::string name;                            ///< For example /points.
  std::string type;                            ///< For example sensor_msgs/PointCloud2.
  Encoding encoding = Encoding::kOther;        ///< Of its messages.
  std::string encoding_name;                   ///< As the file calls it.
  std::optional<std::uint64_t> messages = {};  ///< As the file states it; none where it does not.

  /// Whether it is the same stream.
  bool is_same(const Topic& other) const {
    return name == other.name && type == other.type && encoding == other.encoding;
  }
};

/// One message as it was recorded.
struct Message {
  std::size_t topic = 0;               ///< Its place in Bag::topics().
  std::int64_t received_ns = 0;        ///< When the recorder got it [ns since the epoch].
  std::span<const std::uint8_t> data;  ///< Valid until the next call of next() or rewind().
};

/// A recording, read from front to back in order of the times of reception.
class Bag {
 public:
  Bag() = default;
  virtual ~Bag() = default;
  Bag(const Bag&) = delete;
  Bag& operator=(const Bag&) = delete;

  /// All topics, known once it is open.
  virtual const std::vector<Topic>& topics() const = 0;
  /// The next message of the topics asked for, or none at the end. Throws io::DataError naming the
  /// file and the place in it where the data is damaged.
  virtual std::optional<Message> next() = 0;
  /// Begins anew, with these topics alone (places in topics()); empty = all.
  virtual void rewind(const std::vector<std::size_t>& wanted = {}) = 0;
  /// What a reader must know: cut off, not closed, files joined; one line each, naming the file.
  virtual std::vector<std::string> remarks() const = 0;
  /// What it is: "ROS 1 bag", "ROS 2 bag (SQLite)", "MCAP".
  virtual std::string kind() const = 0;
};

/// Opens a file (.bag, .db3, .mcap; found by content) or a folder with the files of one recording,
/// which are joined in order of time. Memory: an index of the chunks, and as many unpacked chunks
/// as overlap in time, at most kMostUnpackedBytes unless one alone is larger. Throws io::DataError
/// naming the file and what is wrong with it.
std::unique_ptr<Bag> open_bag(const std::filesystem::path& path);

/// "sensor_msgs/msg/PointCloud2" and "sensor_msgs/PointCloud2" are one type: the latter.
std::string plain_type(std::string_view type);
/// By the name that MCAP and SQLite bags give: "ros1", "cdr"; another is kOther.
Encoding encoding_of(std::string_view name);

/// A time within 146 years of 1970: what is beyond is damage, and becomes the limit. Differences of
/// such times and of stamps fit into 64 bits.
std::int64_t bounded_time(std::int64_t time_ns);

constexpr std::size_t kMostUnpackedBytes = 256U << 20U;

}  // namespace understory::bag
