// Tables of text (CSV) with a heading, as spreadsheets and surveyors' programs write them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace understory::io {

/// A row, or the heading.
struct TextRow {
  std::uint64_t line = 0;  ///< Where it begins, from 1.
  std::vector<std::string> cells;
};

/// A table with as many cells in each row as in the heading.
struct TextTable {
  std::string source;    ///< For errors.
  char delimiter = ',';  ///< Semicolon, tab or comma: the first of these that the heading has.
  TextRow heading;       ///< Without cells where the text has none.
  std::vector<TextRow> rows;
};

/// Reads a table. Lines end with LF, CR LF or CR. A cell may stand between quotation marks, with
/// delimiters, line ends and doubled quotation marks in it. Blanks around cells, empty lines, lines
/// that begin with # and a first line `sep=;` are no content. Throws DataError, with source and
/// line, for UTF-16, a quotation mark that is not closed, and a row of another number of cells.
/// Cost: linear in the text, which is copied once.
TextTable parse_text_table(std::string_view text, std::string_view source);

/// A number; a comma is a decimal point where commas do not separate cells. Throws DataError with
/// source, line and the column's name for what is no finite number.
double number_in(const TextTable& table, std::uint64_t line, std::string_view column,
                 std::string_view cell);

}  // namespace understory::io
