#include "common/bag/bag.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "common/bag/joined_bag.hpp"
#include "common/bag/mcap_file.hpp"
#include "common/bag/ros1_bag.hpp"
#include "common/bag/sqlite_bag.hpp"
#include "common/bag/unpack.hpp"
#include "common/io/data_error.hpp"
#include "common/io/file_window.hpp"
#include "common/io/lcm_log.hpp"
#include "common/mcap/encoder.hpp"

namespace understory::bag {
namespace {

constexpr std::string_view kSqliteMagic{"SQLite format 3\0", 16};

std::string first_bytes(const std::filesystem::path& path) {
  io::FileWindow file(path);
  const auto bytes = file.peek(0, kSqliteMagic.size());
  return {bytes.begin(), bytes.end()};
}

[[noreturn]] void refuse_file(const std::filesystem::path& path, const std::string& begin) {
  const std::string name = path.string();
  if (is_zstd({reinterpret_cast<const std::uint8_t*>(begin.data()), begin.size()}))
    throw io::DataError(
        fmt::format("{}: packed as a whole file: unpack it with 'zstd -d {}'", name, name));
  if (begin.starts_with("#ROSBAG V"))
    throw io::DataError(name + ": a ROS 1 bag of a version before 2.0: 'rosbag fix' rewrites it");
  throw io::DataError(name + ": no bag: neither ROS 1 (#ROSBAG V2.0), SQLite nor MCAP");
}

std::unique_ptr<Bag> open_file(const std::filesystem::path& path) {
  try {
    const std::string begin = first_bytes(path);
    if (begin.starts_with(kRos1Magic)) return std::make_unique<Ros1Bag>(path);
    if (begin.starts_with(mcap::kMagic)) return std::make_unique<McapFile>(path);
    if (begin.starts_with(kSqliteMagic)) return std::make_unique<SqliteBag>(path);
    refuse_file(path, begin);
  } catch (const io::LogError& error) {
    throw io::DataError(error.what());
  }
}

bool is_bag_name(const std::filesystem::path& path) {
  constexpr std::array<std::string_view, 4> kEndings{".bag", ".db3", ".mcap", ".active"};
  return std::ranges::find(kEndings, path.extension().string()) != kEndings.end();
}

std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::vector<std::filesystem::path> packed;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    if (is_bag_name(entry.path())) files.push_back(entry.path());
    if (entry.path().extension() == ".zstd") packed.push_back(entry.path());
  }

  if (failed) throw io::DataError(fmt::format("{}: {}", folder.string(), failed.message()));
  if (files.empty() && !packed.empty())
    throw io::DataError(
        fmt::format("{}: packed as whole files: unpack them with 'zstd -d {}/*.zstd'",
                    folder.string(), folder.string()));
  if (files.empty())
    throw io::DataError(folder.string() + ": a folder without .bag, .db3 and .mcap files");
  std::ranges::sort(files);
  return files;
}

}  // namespace

std::unique_ptr<Bag> open_bag(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::is_directory(path, none)) return open_file(path);
  const std::vector<std::filesystem::path> files = files_of(path);
  if (files.size() == 1) return open_file(files.front());
  std::vector<std::unique_ptr<Bag>> parts;
  parts.reserve(files.size());
  for (const auto& file : files) parts.push_back(open_file(file));
  return std::make_unique<JoinedBag>(std::move(parts), path.string());
}

std::string plain_type(std::string_view type) {
  std::string plain(type);
  if (const auto msg = plain.find("/msg/"); msg != std::string::npos) plain.erase(msg, 4);
  return plain;
}

std::int64_t bounded_time(std::int64_t time_ns) {
  constexpr std::int64_t kMost_ns = std::numeric_limits<std::int64_t>::max() / 2;
  return std::clamp(time_ns, -kMost_ns, kMost_ns);
}

Encoding encoding_of(std::string_view name) {
  if (name == "ros1") return Encoding::kRos1;
  if (name == "cdr") return Encoding::kCdr;
  return Encoding::kOther;
}

}  // namespace understory::bag
