#include "common/io/text_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "common/io/data_error.hpp"

namespace understory::io {
namespace {

constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";
constexpr std::string_view kBlanks = " \t";
constexpr std::size_t kLongestCell = 40;

[[noreturn]] void refuse_line(std::string_view source, std::uint64_t line, const std::string& why) {
  throw DataError(fmt::format("{}, line {}: {}", source, line, why));
}

std::string_view without_blanks(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// The delimiter of the first line of `text`.
char delimiter_at(std::string_view text) {
  const std::string_view line = text.substr(0, text.find_first_of("\r\n"));
  for (const char one : {';', '\t'}) {
    if (line.find(one) != std::string_view::npos) return one;
  }
  return ',';
}

/// Reads a text from begin to end.
class TableReader {
 public:
  TableReader(std::string_view text, std::string_view source) : rest_(text), source_(source) {}

  bool is_at_end() const { return rest_.empty(); }
  std::string_view rest() const { return rest_; }

  /// Skips the next line; returns it without its end.
  std::string_view pass_line() {
    const std::size_t size = std::min(rest_.find_first_of("\r\n"), rest_.size());
    const std::string_view line = rest_.substr(0, size);
    rest_.remove_prefix(size);
    pass_line_end();
    return line;
  }

  /// Whether the line is blank or a comment.
  bool is_without_content() const {
    const std::string_view line =
        without_blanks(rest_.substr(0, std::min(rest_.find_first_of("\r\n"), rest_.size())));
    return line.empty() || line.front() == '#';
  }

  TextRow row(char delimiter) {
    TextRow row{line_, {}};
    do {
      row.cells.push_back(cell(delimiter));
    } while (pass(delimiter));
    pass_line_end();
    return row;
  }

 private:
  bool pass(char one) {
    if (rest_.empty() || rest_.front() != one) return false;
    rest_.remove_prefix(1);
    return true;
  }

  void pass_line_end() {
    if (rest_.empty()) return;
    const bool is_pair = rest_.starts_with("\r\n");
    rest_.remove_prefix(is_pair ? 2 : 1);
    ++line_;
  }

  /// Reads up to the delimiter or the end of the line, which stay.
  std::string_view plain_part(char delimiter) {
    const auto is_end = [&](char one) { return one == delimiter || one == '\n' || one == '\r'; };
    const auto end = std::ranges::find_if(rest_, is_end);
    const std::string_view part = rest_.substr(0, static_cast<std::size_t>(end - rest_.begin()));
    rest_.remove_prefix(part.size());
    return part;
  }

  std::string cell(char delimiter) {
    const std::size_t blanks =
        std::min(rest_.find_first_not_of(delimiter == '\t' ? " " : kBlanks), rest_.size());
    if (blanks == rest_.size() || rest_[blanks] != '"')
      return std::string(without_blanks(plain_part(delimiter)));

    rest_.remove_prefix(blanks);
    std::string text(without_blanks(quoted_part()));
    text += without_blanks(plain_part(delimiter));
    return text;
  }

  /// Reads a quoted part; a doubled quotation mark means one.
  std::string quoted_part() {
    const std::uint64_t begin = line_;
    std::string text;
    pass('"');
    while (!rest_.empty()) {
      const bool is_mark = pass('"');
      if (is_mark && !rest_.starts_with('"')) return text;
      if (ends_line()) ++line_;
      text += rest_.front();
      rest_.remove_prefix(1);
    }
    refuse_line(source_, begin, "a quotation mark is not closed");
  }

  /// Whether the next character ends a line; of CR LF it is the LF.
  bool ends_line() const {
    return rest_.front() == '\n' || (rest_.front() == '\r' && !rest_.starts_with("\r\n"));
  }

  std::string_view rest_;
  std::string_view source_;
  std::uint64_t line_ = 1;
};

}  // namespace

TextTable parse_text_table(std::string_view text, std::string_view source) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    throw DataError(fmt::format("{}: UTF-16 text: save it as CSV in UTF-8", source));
  if (text.starts_with(kUtf8Mark)) text.remove_prefix(kUtf8Mark.size());

  TextTable table;
  table.source = source;
  TableReader reader(text, source);
  if (text.starts_with("sep=") || text.starts_with("\"sep=")) reader.pass_line();
  while (!reader.is_at_end()) {
    if (reader.is_without_content()) {
      reader.pass_line();
    } else if (table.heading.cells.empty()) {
      table.delimiter = delimiter_at(reader.rest());
      table.heading = reader.row(table.delimiter);
    } else {
      TextRow row = reader.row(table.delimiter);
      if (row.cells.size() != table.heading.cells.size())
        refuse_line(source, row.line,
                    fmt::format("{} cells, the heading has {}", row.cells.size(),
                                table.heading.cells.size()));
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

double number_in(const TextTable& table, std::uint64_t line, std::string_view column,
                 std::string_view cell) {
  std::string text(cell);
  if (table.delimiter != ',' && cell.find('.') == std::string_view::npos)
    std::ranges::replace(text, ',', '.');
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  if (text.empty() || result.ec != std::errc{} || result.ptr != end || !std::isfinite(value))
    refuse_line(table.source, line,
                fmt::format("{} '{}' is no finite number", column, cell.substr(0, kLongestCell)));
  return value;
}

}  // namespace understory::io
