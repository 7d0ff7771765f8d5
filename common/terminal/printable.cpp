#include "common/terminal/printable.hpp"

#include <fmt/format.h>

#include <cstdint>

namespace understory::terminal {
namespace {

/// A character and its number of bytes; 0 bytes where none begins.
struct Character {
  char32_t code = 0;
  std::size_t bytes = 0;
};

/// Decodes UTF-8 (RFC 3629): no overlong forms, no surrogates, nothing above U+10FFFF.
Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t head = byte(0);
  if (head < 0x80) return {head, 1};
  const std::size_t bytes = head < 0xC2   ? 0
                            : head < 0xE0 ? 2
                            : head < 0xF0 ? 3
                            : head < 0xF5 ? 4
                                          : 0;
  if (bytes == 0 || text.size() < bytes) return {};

  char32_t code = head & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return {};
    code = code << 6U | (byte(i) & 0x3FU);
  }

  const char32_t least = bytes == 2 ? 0x80 : bytes == 3 ? 0x800 : 0x10000;
  const bool is_surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < least || is_surrogate || code > 0x10FFFF) return {};
  return {code, bytes};
}

/// Control characters, and marks that change the order in which a line is shown.
bool steers(char32_t code) {
  if (code < 0x20 || (code >= 0x7F && code < 0xA0)) return true;
  if (code == 0x200E || code == 0x200F || code == 0x2028 || code == 0x2029) return true;
  return (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
}

std::string escaped(std::string_view text, bool keeps_line_feeds) {
  std::string result;
  while (!text.empty()) {
    const Character next = first_character(text);
    const std::size_t bytes = next.bytes == 0 ? 1 : next.bytes;
    const bool is_kept = next.bytes > 0 && !steers(next.code);
    if (is_kept || (keeps_line_feeds && next.code == '\n' && next.bytes == 1)) {
      result += text.substr(0, bytes);
    } else {
      for (const char c : text.substr(0, bytes)) {
        result += fmt::format("\\x{:02x}", static_cast<std::uint8_t>(c));
      }
    }
    text.remove_prefix(bytes);
  }
  return result;
}

}  // namespace

std::string printable(std::string_view text) { return escaped(text, false); }

std::string printable_lines(std::string_view text) { return escaped(text, true); }

}  // namespace understory::terminal
