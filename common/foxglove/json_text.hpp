// JSON written straight to text: the messages are large and their form is known.
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

namespace understory::foxglove {

/// Writes one JSON value from front to back; commas are added automatically. The caller must close
/// every opened object and array. Text must be UTF-8 (`terminal::printable` makes it so).
class JsonText {
 public:
  /// {
  void begin_object() { open('{'); }
  /// }
  void end_object() { close('}'); }
  /// [
  void begin_array() { open('['); }
  /// ]
  void end_array() { close(']'); }
  /// The name of the next value.
  void key(std::string_view name);

  /// A number in the shortest form that reads back equal; null if it is not finite.
  void value(double number);
  /// An integer.
  template <std::integral Integer>
  requires(!std::same_as<Integer, bool>) void value(Integer number) { whole(number); }
  /// true or false.
  template <std::same_as<bool> Flag>
  void value(Flag flag) {
    put(flag ? "true" : "false");
  }
  /// Text, escaped.
  void value(std::string_view text);
  /// Text, escaped.
  void value(const char* text) { value(std::string_view(text)); }
  /// Bytes as base64 (RFC 4648, with padding).
  void base64(std::string_view bytes);
  /// Complete JSON, written unchanged.
  void raw(std::string_view json) { put(json); }

  /// A name and its value.
  template <class Value>
  void field(std::string_view name, const Value& content) {
    key(name);
    value(content);
  }

  /// The text; nothing may follow.
  std::string take() { return std::move(text_); }
  /// Bytes so far.
  std::size_t size() const { return text_.size(); }

 private:
  void open(char bracket);
  void close(char bracket);
  void put(std::string_view token);
  void comma();
  void whole(std::int64_t number);
  void whole(std::uint64_t number);
  template <std::integral Integer>
  void whole(Integer number) {
    whole(static_cast<std::int64_t>(number));
  }

  std::string text_;
  bool needs_comma_ = false;
};

/// `value` at a precision of 0.1 mm, or 1e-4 of any unit: sufficient for a display, in few bytes.
double rounded(double value);

}  // namespace understory::foxglove
