#include "sim/changes/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

#include "common/io/data_error.hpp"

namespace understory::sim::changes {
namespace {

/// Whether the whole cell is a number of this type.
template <typename Number, typename... Base>
bool parses(std::string_view cell, Number& value, Base... base) {
  const char* const end = cell.data() + cell.size();
  const auto result = std::from_chars(cell.data(), end, value, base...);
  return !cell.empty() && result.ec == std::errc{} && result.ptr == end;
}

}  // namespace

TableReader::TableReader(std::string_view text, std::string source, std::string_view heading)
    : rest_(text), source_(std::move(source)) {
  const std::string_view first = take_line();
  if (first != heading)
    refuse(fmt::format("'{}' where the heading '{}' is wanted", first.substr(0, 60), heading));
  split(first);
  names_ = cells_;
}

std::string_view TableReader::take_line() {
  ++line_;
  const std::size_t end = rest_.find('\n');
  if (end == std::string_view::npos) refuse("the line is cut off");
  const std::string_view line = rest_.substr(0, end);
  rest_.remove_prefix(end + 1);
  return line;
}

void TableReader::split(std::string_view line) {
  cells_.clear();
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells_.push_back(line.substr(begin, end - begin));
    begin = end + 1;
  }
}

bool TableReader::next() {
  if (rest_.empty()) return false;
  split(take_line());
  if (cells_.size() != names_.size())
    refuse(fmt::format("{} cells, the heading has {}", cells_.size(), names_.size()));
  return true;
}

void TableReader::refuse(const std::string& why) const {
  throw io::DataError(fmt::format("{}, line {}: {}", source_, line_, why));
}

void TableReader::refuse_cell(std::size_t column, std::string_view wanted) const {
  refuse(fmt::format("{} '{}' is no {}", names_[column], cells_[column].substr(0, 40), wanted));
}

std::string_view TableReader::text(std::size_t column) const { return cells_[column]; }

double TableReader::number(std::size_t column) const {
  double value = 0.0;
  if (!parses(cells_[column], value) || !std::isfinite(value)) refuse_cell(column, "finite number");
  return value;
}

std::uint64_t TableReader::count(std::size_t column) const {
  std::uint64_t value = 0;
  if (!parses(cells_[column], value)) refuse_cell(column, "whole number from 0 on");
  return value;
}

std::int64_t TableReader::integer(std::size_t column) const {
  std::int64_t value = 0;
  if (!parses(cells_[column], value)) refuse_cell(column, "whole number");
  return value;
}

std::uint64_t TableReader::hexadecimal(std::size_t column, std::size_t word) const {
  constexpr std::size_t kDigits = 16;
  std::uint64_t value = 0;
  const std::string_view cell = cells_[column];
  if (cell.size() < (word + 1) * kDigits ||
      !parses(cell.substr(word * kDigits, kDigits), value, 16))
    refuse_cell(column, "descriptor in hexadecimal digits");
  return value;
}

}  // namespace understory::sim::changes
