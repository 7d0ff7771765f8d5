// One line of a graph file.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace understory::factor_graph::files {

/// Squares and products of numbers up to this limit are finite.
constexpr double kGreatestNumber = 1e30;

/// A line, word by word. It stores the fault of its numbers.
class GraphLine {
 public:
  /// The text without its line feed; it must outlive the line.
  explicit GraphLine(std::string_view text) : text_(text) {}
  /// The next word; empty at the end.
  std::string_view word() {
    const auto begin = text_.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return text_ = {};
    text_.remove_prefix(begin);
    const auto end = text_.find_first_of(" \t\r");
    const std::string_view result = text_.substr(0, end);
    text_.remove_prefix(result.size());
    return result;
  }
  /// The next number; a missing or malformed one is stored as a fault.
  double number() {
    const std::string_view one = word();
    double value = 0.0;
    const auto [end, error] = std::from_chars(one.data(), one.data() + one.size(), value);
    if (error != std::errc{} || end != one.data() + one.size() || one.empty() ||
        !std::isfinite(value)) {
      is_whole_ = false;
    }
    if (std::abs(value) > kGreatestNumber) is_moderate_ = false;
    return value;
  }
  /// The next number, which must be whole.
  std::int64_t integer() {
    const double value = number();
    if (std::abs(value) > 9e15 || value != std::floor(value)) is_whole_ = false;
    return is_whole_ ? static_cast<std::int64_t>(value) : 0;
  }
  /// Fault of the numbers so far; none = no fault.
  std::optional<std::string> fault() const {
    if (!is_whole_) return "a number is missing or is none";
    if (!is_moderate_) return "a number is beyond 1e30";
    return std::nullopt;
  }

 private:
  std::string_view text_;
  bool is_whole_ = true;
  bool is_moderate_ = true;
};

}  // namespace understory::factor_graph::files
