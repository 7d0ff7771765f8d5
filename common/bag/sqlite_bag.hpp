// ROS 2 bags in SQLite (rosbag2_storage_sqlite3): one file.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/bag/bag.hpp"

namespace understory::bag {

/// Reads tables `topics` and `messages`. The file is not written to, not even its journals, except
/// where a write-ahead log of a recorder that died lies beside it: that is read, too.
class SqliteBag : public Bag {
 public:
  /// Throws io::DataError.
  explicit SqliteBag(const std::filesystem::path& path);
  ~SqliteBag() override;

  const std::vector<Topic>& topics() const override { return topics_; }
  std::optional<Message> next() override;
  void rewind(const std::vector<std::size_t>& wanted) override;
  std::vector<std::string> remarks() const override { return remarks_; }
  std::string kind() const override { return "ROS 2 bag (SQLite)"; }

 private:
  class Database;
  void list_topics();

  std::string source_;
  std::unique_ptr<Database> database_;
  std::vector<Topic> topics_;
  std::vector<std::int64_t> ids_;  ///< Of topics_ in the file.
  std::vector<std::string> remarks_;
  std::vector<std::uint8_t> data_;  ///< Of the message given last.
};

}  // namespace understory::bag
