// Tables of text (CSV) with a heading, in the form of spreadsheets and surveyors' programs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace understory::io {

/// A row, or the heading.
struct TextRow {
  std::uint64_t line = 0;  ///< First line of the row, from 1.
  std::vector<std::string> cells;
};

/// A table with as many cells in each row as in the heading.
struct TextTable {
  std::string source;    ///< Name for error messages.
  char delimiter = ',';  ///< Semicolon, tab or comma: the first of these in the heading.
  TextRow heading;       ///< Without cells if the text is empty.
  std::vector<TextRow> rows;
};

/// Reads a table. Lines end with LF, CR LF or CR. A cell may be in quotation marks and then contain
/// delimiters, line ends and doubled quotation marks. Blanks around cells, empty lines, lines that
/// begin with # and a first line `sep=;` are ignored. Throws DataError, with source and line, for
/// UTF-16, an unclosed quotation mark, and a row with another number of cells. Cost: linear in the
/// text, which is copied once.
TextTable parse_text_table(std::string_view text, std::string_view source);

/// A number; a comma is a decimal point if commas do not separate cells. Throws DataError with
/// source, line and the column's name where it is not a finite number.
double number_in(const TextTable& table, std::uint64_t line, std::string_view column,
                 std::string_view cell);

}  // namespace understory::io
