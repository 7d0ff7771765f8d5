// Tables of text (CSV), written exactly and read strictly.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace understory::sim::changes {

/// Reads a table row by row. Any error throws io::DataError with file, line and column.
class TableReader {
 public:
  /// `heading`: required first line. The text must outlive the reader.
  TableReader(std::string_view text, std::string source, std::string_view heading);

  /// Goes to the next row; false at the end.
  bool next();
  /// Cells of the present row, by column number.
  std::string_view text(std::size_t column) const;
  double number(std::size_t column) const;                                ///< Finite.
  std::uint64_t count(std::size_t column) const;                          ///< Not negative.
  std::int64_t integer(std::size_t column) const;                         ///< Of either sign.
  std::uint64_t hexadecimal(std::size_t column, std::size_t word) const;  ///< 16 digits of a cell.
  /// Refuses the present row.
  [[noreturn]] void refuse(const std::string& why) const;
  /// Refuses a cell of the present row.
  [[noreturn]] void refuse_cell(std::size_t column, std::string_view wanted) const;

 private:
  std::string_view take_line();
  void split(std::string_view line);

  std::string_view rest_;
  std::string source_;
  std::vector<std::string_view> names_;
  std::vector<std::string_view> cells_;
  std::uint64_t line_ = 0;
};

}  // namespace understory::sim::changes
