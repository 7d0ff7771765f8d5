#include "services/viewer/frame_writer.hpp"

#include <bit>
#include <cstring>

namespace understory::viewer {

static_assert(std::endian::native == std::endian::little, "arrays travel as they are in memory");

namespace {

constexpr std::size_t kAlignment = 8;

std::size_t padding(std::size_t bytes) { return (kAlignment - bytes % kAlignment) % kAlignment; }

}  // namespace

void FrameWriter::add_bytes(const std::string& name, const char* type, const void* values,
                            std::size_t count, std::size_t bytes) {
  list_.push_back({name, type, count});
  if (bytes > 0) payload_.append(static_cast<const char*>(values), bytes);
  payload_.append(padding(payload_.size()), '\0');
}

void FrameWriter::add(const std::string& name, std::span<const std::uint8_t> values) {
  add_bytes(name, "u8", values.data(), values.size(), values.size_bytes());
}
void FrameWriter::add(const std::string& name, std::span<const std::uint32_t> values) {
  add_bytes(name, "u32", values.data(), values.size(), values.size_bytes());
}
void FrameWriter::add(const std::string& name, std::span<const float> values) {
  add_bytes(name, "f32", values.data(), values.size(), values.size_bytes());
}
void FrameWriter::add(const std::string& name, std::span<const double> values) {
  add_bytes(name, "f64", values.data(), values.size(), values.size_bytes());
}

std::shared_ptr<const std::string> FrameWriter::message(nlohmann::ordered_json header) const {
  header["arrays"] = list_;
  // Texts of processes may contain any bytes: invalid UTF-8 is replaced.
  std::string text = header.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  text.append(padding(sizeof(std::uint32_t) + text.size()), ' ');

  auto message = std::make_shared<std::string>();
  const auto size = static_cast<std::uint32_t>(text.size());
  message->reserve(sizeof(size) + text.size() + payload_.size());
  message->append(reinterpret_cast<const char*>(&size), sizeof(size));
  message->append(text);
  message->append(payload_);
  return message;
}

}  // namespace understory::viewer
