// What a page has after the frames that it got (services/viewer/protocol.md).
#pragma once

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace understory::test {

/// One message, taken apart.
struct PageFrame {
  nlohmann::json header;
  std::map<std::string, std::string> arrays;  ///< Bytes, by name.

  explicit PageFrame(const std::string& message) {
    std::uint32_t size = 0;
    std::memcpy(&size, message.data(), sizeof(size));
    header = nlohmann::json::parse(message.substr(sizeof(size), size));
    std::size_t at = sizeof(size) + size;
    for (const auto& array : header.at("arrays")) {
      if (at % 8 != 0) throw std::runtime_error("an array is not aligned");
      const std::string type = array.at(1);
      const std::size_t bytes = array.at(2).get<std::size_t>() * (type == "u8"    ? 1
                                                                  : type == "f64" ? 8
                                                                                  : 4);
      arrays[array.at(0)] = message.substr(at, bytes);
      at += (bytes + 7) / 8 * 8;
    }
    if (at != message.size()) throw std::runtime_error("bytes are left over");
  }
  template <class T>
  std::vector<T> array(const std::string& name) const {
    const std::string& bytes = arrays.at(name);
    std::vector<T> values(bytes.size() / sizeof(T));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
};

/// Landmarks and paths of one run.
struct PageReplica {
  struct Landmark {
    std::uint64_t id = 0;
    float x = 0.0F;
    float y = 0.0F;
    float probability = 0.0F;
    int flags = 0;
  };
  std::map<std::uint32_t, Landmark> landmarks;  ///< By slot, those that are there.
  std::vector<std::pair<float, float>> path;
  std::vector<std::pair<float, float>> keyframes;
  nlohmann::json parts;  ///< The rest, as it was told last.
  int resets = 0;

  void take(const PageFrame& frame) {
    const auto& header = frame.header;
    if (header.value("reset", false)) {
      landmarks.clear();
      path.clear();
      keyframes.clear();
      ++resets;
    }
    if (header.contains("landmarks")) take_landmarks(frame);
    take_track(frame, "path", "path", path);
    take_track(frame, "keyframes", "keyframe", keyframes);
    for (const auto& [key, value] : header.items()) parts[key] = value;
  }

 private:
  void take_landmarks(const PageFrame& frame) {
    const auto slot = frame.array<std::uint32_t>("slot");
    const auto low = frame.array<std::uint32_t>("id_low");
    const auto high = frame.array<std::uint32_t>("id_high");
    const auto x = frame.array<float>("x");
    const auto y = frame.array<float>("y");
    const auto probability = frame.array<float>("probability");
    const auto flags = frame.array<std::uint8_t>("flags");
    for (std::size_t i = 0; i < slot.size(); ++i) {
      landmarks.erase(slot[i]);
      if ((flags.at(i) & 1) == 0) continue;
      landmarks[slot[i]] = {(std::uint64_t{high.at(i)} << 32U) | low.at(i), x.at(i), y.at(i),
                            probability.at(i), flags.at(i)};
    }
  }
  static void take_track(const PageFrame& frame, const char* key, const std::string& prefix,
                         std::vector<std::pair<float, float>>& track) {
    if (!frame.header.contains(key)) return;
    const auto x = frame.array<float>(prefix + "_x");
    const auto y = frame.array<float>(prefix + "_y");
    track.resize(frame.header.at(key).at("first").get<std::size_t>());
    for (std::size_t i = 0; i < x.size(); ++i) track.emplace_back(x[i], y.at(i));
    if (track.size() != frame.header.at(key).at("total").get<std::size_t>())
      throw std::runtime_error("a path has not the length that was told");
  }
};

}  // namespace understory::test
