#include "common/foxglove/json_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

namespace understory::foxglove {
namespace {

constexpr std::string_view kBase64 =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::uint32_t byte_at(std::string_view bytes, std::size_t i) {
  return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0U;
}

}  // namespace

void JsonText::key(std::string_view name) {
  value(name);
  text_ += ':';
  needs_comma_ = false;
}

void JsonText::value(double number) {
  if (!std::isfinite(number)) return put("null");
  comma();
  fmt::format_to(std::back_inserter(text_), "{}", number);
}

void JsonText::value(std::string_view text) {
  comma();
  text_ += '"';
  for (const char byte : text) {
    const auto code = static_cast<unsigned char>(byte);
    if (byte == '"' || byte == '\\') {
      text_ += '\\';
      text_ += byte;
    } else if (code < 0x20) {
      fmt::format_to(std::back_inserter(text_), "\\u{:04x}", code);
    } else {
      text_ += byte;
    }
  }
  text_ += '"';
}

void JsonText::base64(std::string_view bytes) {
  comma();
  text_ += '"';
  text_.reserve(text_.size() + (bytes.size() / 3 + 1) * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::uint32_t group =
        byte_at(bytes, i) << 16U | byte_at(bytes, i + 1) << 8U | byte_at(bytes, i + 2);
    text_ += kBase64[group >> 18U];
    text_ += kBase64[group >> 12U & 63U];
    text_ += i + 1 < bytes.size() ? kBase64[group >> 6U & 63U] : '=';
    text_ += i + 2 < bytes.size() ? kBase64[group & 63U] : '=';
  }
  text_ += '"';
}

void JsonText::open(char bracket) {
  comma();
  text_ += bracket;
  needs_comma_ = false;
}

void JsonText::close(char bracket) {
  text_ += bracket;
  needs_comma_ = true;
}

void JsonText::put(std::string_view token) {
  comma();
  text_ += token;
}

void JsonText::comma() {
  if (needs_comma_) text_ += ',';
  needs_comma_ = true;
}

void JsonText::whole(std::int64_t number) {
  comma();
  fmt::format_to(std::back_inserter(text_), "{}", number);
}

void JsonText::whole(std::uint64_t number) {
  comma();
  fmt::format_to(std::back_inserter(text_), "{}", number);
}

double rounded(double value) {
  // Larger values have no such digit, and the product might not be finite.
  return std::abs(value) < 1e11 ? std::round(value * 1e4) / 1e4 : value;
}

}  // namespace understory::foxglove
