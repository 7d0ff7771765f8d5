// Comma-separated tables with a header, without quotes.
#pragma once

#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace understory::eval::experiments::existence {

/// Row after row of a text.
class CsvRows {
 public:
  explicit CsvRows(std::string_view text) : rest_(text) {
    next();
    names_.assign(cells_.begin(), cells_.end());
  }
  /// Throws std::runtime_error where there is no such column.
  std::size_t column(std::string_view name) const {
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (names_[i] == name) return i;
    throw std::runtime_error("table without the column " + std::string(name));
  }
  /// The next row; false at the end.
  bool next() {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view{} : rest_.substr(end + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    cells_.clear();
    for (std::size_t comma = 0; comma != std::string_view::npos;) {
      comma = line.find(',');
      cells_.push_back(line.substr(0, comma));
      if (comma != std::string_view::npos) line.remove_prefix(comma + 1);
    }
    return true;
  }
  std::string_view text(std::size_t column) const {
    return column < cells_.size() ? cells_[column] : std::string_view{};
  }
  /// Nothing where the cell holds no number.
  std::optional<double> number(std::size_t column) const {
    const std::string cell(text(column));
    char* end = nullptr;
    const double value = std::strtod(cell.c_str(), &end);
    if (cell.empty() || end != cell.c_str() + cell.size()) return std::nullopt;
    return value;
  }

 private:
  std::string_view rest_;
  std::vector<std::string> names_;
  std::vector<std::string_view> cells_;
};

}  // namespace understory::eval::experiments::existence
