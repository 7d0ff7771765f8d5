#include "common/io/date_time.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <optional>
#include <string>

#include "common/io/data_error.hpp"

namespace understory::io {
namespace {

constexpr std::string_view kBlank = " \t\r\n";

/// Reads a line from its begin; a missing part makes the result none.
class DateReader {
 public:
  explicit DateReader(std::string_view line) : rest_(line) {}

  bool is_good() const { return is_good_; }
  bool is_at_end() const { return rest_.empty(); }

  int digits(std::size_t count) {
    int value = 0;
    const char* const begin = rest_.data();
    const std::size_t size = std::min(count, rest_.size());
    const auto read = std::from_chars(begin, begin + size, value);
    is_good_ = is_good_ && size == count && read.ptr == begin + count && begin[0] != '-';
    rest_.remove_prefix(size);
    return value;
  }
  bool pass(std::string_view any) {
    if (rest_.empty() || any.find(rest_.front()) == std::string_view::npos) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void want(std::string_view any) { is_good_ = pass(any) && is_good_; }
  /// Reads a fraction as microseconds.
  int micros() {
    if (!pass(".,")) return 0;
    constexpr std::string_view kDigits = "0123456789";
    std::string fraction(rest_.substr(0, rest_.find_first_not_of(kDigits)));
    is_good_ = is_good_ && !fraction.empty();
    rest_.remove_prefix(fraction.size());
    fraction.resize(6, '0');
    int value = 0;
    std::from_chars(fraction.data(), fraction.data() + fraction.size(), value);
    return value;
  }
  /// Reads the offset from UTC [s].
  int offset_s() {
    if (pass("Zz") || is_at_end()) return 0;
    const int sign = pass("-") ? -1 : 1;
    if (sign > 0) want("+");
    const int hours = digits(2);
    pass(":");
    const int minutes = is_at_end() ? 0 : digits(2);
    is_good_ = is_good_ && hours <= 14 && minutes <= 59;
    return sign * (hours * 3600 + minutes * 60);
  }

 private:
  std::string_view rest_;
  bool is_good_ = true;
};

std::optional<model::Utime> date_time(std::string_view line) {
  DateReader reader(line);
  const int year = reader.digits(4);
  reader.want("-");
  const int month = reader.digits(2);
  reader.want("-");
  const int day_of_month = reader.digits(2);
  reader.want(" T");
  const int hour = reader.digits(2);
  reader.want(":");
  const int minute = reader.digits(2);
  reader.want(":");
  const int second = reader.digits(2);
  const int micros = reader.micros();
  const int offset_s = reader.offset_s();

  const std::chrono::year_month_day day{std::chrono::year(year),
                                        std::chrono::month(static_cast<unsigned>(month)),
                                        std::chrono::day(static_cast<unsigned>(day_of_month))};
  if (!reader.is_good() || !reader.is_at_end() || !day.ok() || hour > 23 || minute > 59 ||
      second > 60)
    return std::nullopt;
  const auto days = std::chrono::sys_days(day).time_since_epoch().count();
  const model::Utime seconds =
      static_cast<model::Utime>(days) * 86400 + hour * 3600 + minute * 60 + second - offset_s;
  return seconds * 1'000'000 + micros;
}

}  // namespace

bool begins_with_date(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(kBlank), text.size());
  DateReader reader(text.substr(first));
  reader.digits(4);
  reader.want("-");
  reader.digits(2);
  reader.want("-");
  return reader.is_good();
}

std::vector<model::Utime> parse_date_times(std::string_view text, std::string_view source) {
  std::vector<model::Utime> stamps;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    ++number;
    const std::size_t first = line.find_first_not_of(kBlank);
    if (first == std::string_view::npos) continue;
    const std::string_view content = line.substr(first, line.find_last_not_of(kBlank) - first + 1);
    const auto stamp = date_time(content);
    if (!stamp)
      throw DataError(
          fmt::format("{}, line {}: '{}' is no time stamp", source, number, content.substr(0, 40)));
    stamps.push_back(*stamp);
  }
  return stamps;
}

}  // namespace understory::io
