#include "common/io/number_reader.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "common/io/data_error.hpp"

namespace understory::io {
namespace {

bool separates(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',' || c == ';';
}

}  // namespace

std::string_view NumberReader::next_token() {
  while (at_ < text_.size() && separates(text_[at_])) {
    if (text_[at_] == '\n') ++line_;
    ++at_;
  }
  const std::size_t start = at_;
  while (at_ < text_.size() && !separates(text_[at_])) ++at_;
  return text_.substr(start, at_ - start);
}

std::optional<double> NumberReader::next() {
  const std::string_view token = next_token();
  if (token.empty()) return std::nullopt;
  ++tokens_;
  double value = 0.0;
  const char* end = token.data() + token.size();
  const auto result = std::from_chars(token.data(), end, value);
  if (result.ec != std::errc{} || result.ptr != end || !std::isfinite(value)) {
    throw DataError(fmt::format("{}: '{}' is not a finite number", where(), token.substr(0, 40)));
  }
  return value;
}

double NumberReader::require(std::string_view what) {
  const auto value = next();
  if (!value) throw DataError(fmt::format("{}: the file ends where {} is expected", where(), what));
  return *value;
}

void NumberReader::skip_line() {
  while (at_ < text_.size() && text_[at_] != '\n') ++at_;
}

std::string NumberReader::where() const {
  return fmt::format("{}, line {}, token {}", source_, line_, tokens_);
}

}  // namespace understory::io
