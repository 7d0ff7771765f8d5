// The bytes of one message to a page: a JSON header, followed by arrays (protocol.md).
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

namespace understory::viewer {

/// Collects arrays; message() puts the header before them.
class FrameWriter {
 public:
  /// Adds an array. `name` must be new.
  void add(const std::string& name, std::span<const std::uint8_t> values);
  void add(const std::string& name, std::span<const std::uint32_t> values);
  void add(const std::string& name, std::span<const float> values);
  void add(const std::string& name, std::span<const double> values);
  /// The whole message; `header` gets the list of arrays.
  std::shared_ptr<const std::string> message(nlohmann::ordered_json header) const;

 private:
  void add_bytes(const std::string& name, const char* type, const void* values, std::size_t count,
                 std::size_t bytes);

  nlohmann::ordered_json list_ = nlohmann::ordered_json::array();
  std::string payload_;
};

}  // namespace understory::viewer
