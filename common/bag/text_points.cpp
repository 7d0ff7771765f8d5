#include "common/bag/text_points.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "common/io/data_error.hpp"

namespace understory::bag {
namespace {

/// The words of a text, one after another.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}

  /// Empty at the end.
  std::string_view next() {
    constexpr std::string_view kSpace = " \t\r\n";
    const std::size_t begin = std::min(text_.find_first_not_of(kSpace, at_), text_.size());
    at_ = std::min(text_.find_first_of(kSpace, begin), text_.size());
    return text_.substr(begin, at_ - begin);
  }
  std::size_t at() const { return at_; }  ///< Offset after the last word.

 private:
  std::string_view text_;
  std::size_t at_ = 0;
};

template <class T>
std::optional<T> number_in(std::string_view word) {
  T value{};
  const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
  if (read.ec != std::errc{} || read.ptr != word.data() + word.size()) return std::nullopt;
  return value;
}

template <class T>
bool put_number(std::string_view word, std::uint8_t* at) {
  auto value = number_in<T>(word);
  if constexpr (std::is_integral_v<T>) {
    // Some programs write whole numbers as 3.000.
    const auto real = value ? std::nullopt : number_in<double>(word);
    constexpr double kExact = 9e15;  // A double holds every whole number up to here.
    constexpr auto kMost = std::min(kExact, static_cast<double>(std::numeric_limits<T>::max()));
    constexpr double kLeast = std::is_signed_v<T> ? -kMost : 0.0;
    if (real && *real == std::floor(*real) && *real >= kLeast && *real <= kMost)
      value = static_cast<T>(*real);
  }
  if (!value) return false;
  std::memcpy(at, &*value, sizeof *value);
  return true;
}

/// Stores one number of the text in its field's type.
bool put_word(std::string_view word, FieldType type, std::uint8_t* at) {
  switch (type) {
    case FieldType::kInt8:
      return put_number<std::int8_t>(word, at);
    case FieldType::kUint8:
      return put_number<std::uint8_t>(word, at);
    case FieldType::kInt16:
      return put_number<std::int16_t>(word, at);
    case FieldType::kUint16:
      return put_number<std::uint16_t>(word, at);
    case FieldType::kInt32:
      return put_number<std::int32_t>(word, at);
    case FieldType::kUint32:
      return put_number<std::uint32_t>(word, at);
    case FieldType::kFloat32:
      return put_number<float>(word, at);
    case FieldType::kFloat64:
      return put_number<double>(word, at);
    case FieldType::kInt64:
      return put_number<std::int64_t>(word, at);
    case FieldType::kUint64:
      return put_number<std::uint64_t>(word, at);
  }
  return false;
}

}  // namespace

std::vector<std::uint8_t> points_of_text(std::span<const TextField> fields, std::uint64_t points,
                                         std::string_view text, std::string_view source) {
  std::uint64_t numbers = 0;
  std::uint64_t point_bytes = 0;
  for (const TextField& field : fields) {
    numbers += field.count;
    point_bytes += std::uint64_t{field.count} * field.bytes;
  }
  // A number and its separator need two bytes: refuse before allocating.
  if (points * numbers > text.size() / 2 + 1)
    throw io::DataError(
        fmt::format("{}: {} bytes of text for {} points", source, text.size(), points));

  std::vector<std::uint8_t> out(points * point_bytes);
  std::uint8_t* to = out.data();
  Words words(text);
  for (std::uint64_t i = 0; i < points; ++i) {
    for (const TextField& field : fields) {
      for (std::uint32_t c = 0; c < field.count; ++c, to += field.bytes) {
        const std::string_view word = words.next();
        if (field.is_read && !put_word(word, field.type, to))
          throw io::DataError(
              fmt::format("{}: '{}' at byte {} of the points is no number of field {}", source,
                          word.substr(0, 40), words.at() - word.size(), field.name));
      }
    }
  }
  return out;
}

}  // namespace understory::bag
