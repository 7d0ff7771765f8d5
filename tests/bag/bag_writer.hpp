// Bags as the real recorders write them, small: the layouts of rosbag, rosbag2 and @mcap/core.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/bag/message_writer.hpp"

namespace understory::test {

/// A message to be recorded.
struct Recorded {
  std::string topic;
  std::string type;  ///< Plain: sensor_msgs/Imu.
  std::int64_t time_ns = 0;
  MessageBytes data;
};

/// A container, and how it is written.
struct BagForm {
  enum class Kind { kRos1, kSqlite, kMcap };
  Kind kind = Kind::kRos1;
  std::string packing = "none";  ///< none, lz4, bz2 (ROS 1), zstd (MCAP).
  bool has_index = true;         ///< Closed, with index and summary.
  bool has_chunks = true;        ///< MCAP alone.
  std::size_t chunk_bytes = 2000;

  std::string name() const;
  /// "run.bag", "run.db3", "run.mcap"
  std::string file() const;
  bag::Encoding encoding() const {
    return kind == Kind::kRos1 ? bag::Encoding::kRos1 : bag::Encoding::kCdr;
  }
};

/// Every kind, with every packing, with and without index.
std::vector<BagForm> all_bag_forms();

/// Writes the messages in the order given.
void write_bag(const std::filesystem::path& path, const BagForm& form,
               const std::vector<Recorded>& messages);

/// The bytes of a file, and the reverse.
std::string file_bytes(const std::filesystem::path& path);
void set_file_bytes(const std::filesystem::path& path, const std::string& bytes);

}  // namespace understory::test
