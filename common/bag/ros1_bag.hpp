// ROS 1 bags, version 2.0 (http://wiki.ros.org/Bags/Format/2.0).
//
// This is an own reader, because librosbag-storage needs 42 packages of ROS's build tools and a
// plugin on ROS's package path, does not open a bag whose recorder died, and crashed on two of 200
// damaged bags.
#pragma once

#include "common/bag/chunked_bag.hpp"

namespace understory::bag {

/// A bag, closed or not.
class Ros1Bag : public ChunkedBag {
 public:
  /// Throws io::DataError.
  explicit Ros1Bag(const std::filesystem::path& path);
  std::string kind() const override { return "ROS 1 bag"; }

 protected:
  void read_records(std::span<const std::uint8_t> records, ChunkContent& content) const override;

 private:
  struct Record;
  void walk();
  bool read_record(std::uint64_t offset, Record& record);
  void take(const Record& record);
  void take_chunk(const Record& record);
  void take_index(const Record& record);
  std::vector<std::uint8_t> data_of(const Record& record);

  bool is_closed_ = false;
};

constexpr std::string_view kRos1Magic = "#ROSBAG V2.0\n";

}  // namespace understory::bag
