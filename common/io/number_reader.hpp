// Numbers separated by white space, commas or semicolons, with errors that name the place.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace understory::io {

/// Reads a text number by number; line breaks are white space.
class NumberReader {
 public:
  /// `source` names the text in error messages. The text must outlive the reader.
  NumberReader(std::string_view text, std::string source)
      : text_(text), source_(std::move(source)) {}

  /// The next finite number, or none at the end of the text. Throws DataError on anything else.
  std::optional<double> next();
  /// The next number, called `what` in the error when it is missing or not a finite number.
  double require(std::string_view what);
  /// Skips the rest of the present line (e.g. a heading).
  void skip_line();

  std::uint64_t tokens() const { return tokens_; }  ///< Number of tokens so far.
  /// Place of the last number: "file, line 3, token 17".
  std::string where() const;

 private:
  std::string_view next_token();

  std::string_view text_;
  std::string source_;
  std::size_t at_ = 0;
  std::uint64_t line_ = 1;
  std::uint64_t tokens_ = 0;
};

}  // namespace understory::io
