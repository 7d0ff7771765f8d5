// Synthetic logs and what a reader makes of them.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "common/io/lcm_log.hpp"

namespace understory::test {

/// A directory that goes away with the test.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "understory-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp: " + name);
    path_ = name;
  }
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

using Bytes = std::vector<std::uint8_t>;

inline Bytes read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void write_bytes(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
}

/// `count` events of random sizes and contents on three channels.
inline std::vector<io::LogEvent> random_events(std::size_t count, std::mt19937_64& random) {
  std::uniform_int_distribution<std::size_t> size(0, 400);
  std::uniform_int_distribution<int> byte(0, 255);
  const char* const channels[] = {"LANDMARKS", "KEYFRAME", "X"};
  std::vector<io::LogEvent> events(count);
  for (std::size_t i = 0; i < count; ++i) {
    events[i].number = static_cast<std::int64_t>(i);
    events[i].utime = 1'700'000'000'000'000 + static_cast<std::int64_t>(i) * 100'000;
    events[i].channel = channels[i % 3];
    events[i].data.resize(size(random));
    for (auto& value : events[i].data) value = static_cast<std::uint8_t>(byte(random));
  }
  return events;
}

inline void write_log(const std::filesystem::path& path, const std::vector<io::LogEvent>& events) {
  io::LcmLogWriter writer(path);
  for (const auto& event : events) writer.write(event);
  writer.commit();
}

inline std::vector<io::LogEvent> read_log(io::LcmLogReader& reader) {
  std::vector<io::LogEvent> events;
  while (auto event = reader.next()) events.push_back(std::move(*event));
  return events;
}

inline bool same(const io::LogEvent& a, const io::LogEvent& b) {
  return a.number == b.number && a.utime == b.utime && a.channel == b.channel && a.data == b.data;
}

/// Where each event starts, and the end of the last one.
inline std::vector<std::size_t> offsets(const std::vector<io::LogEvent>& events) {
  std::vector<std::size_t> starts{0};
  for (const auto& e : events)
    starts.push_back(starts.back() + 28 + e.channel.size() + e.data.size());
  return starts;
}

}  // namespace understory::test
