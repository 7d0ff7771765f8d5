#include "common/map_file/sql_text.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <vector>

namespace understory::map_file {
namespace {

enum class TokenKind { kWord, kQuoted, kString, kNumber, kSymbol };

struct Token {
  TokenKind kind = TokenKind::kSymbol;
  std::string text;  ///< Words and names in lower case.
};
using Tokens = std::vector<Token>;

char lower(char letter) {
  return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), lower);
  return result;
}

bool is_digit(char letter) { return letter >= '0' && letter <= '9'; }

/// Bytes above ASCII belong to names, as in SQLite.
bool is_of_name(char letter) {
  const char small = lower(letter);
  return (small >= 'a' && small <= 'z') || is_digit(letter) || letter == '_' || letter == '$' ||
         static_cast<unsigned char>(letter) >= 0x80;
}

bool is_space(char letter) {
  return letter == ' ' || letter == '\n' || letter == '\t' || letter == '\r' || letter == '\f';
}

/// The quoted text at the front, quotes included; empty where it is not closed.
std::string_view quoted_at_front(std::string_view sql) {
  const char end = sql.front() == '[' ? ']' : sql.front();
  for (std::size_t at = 1; at < sql.size(); ++at) {
    if (sql[at] != end) continue;
    const bool is_doubled = end != ']' && at + 1 < sql.size() && sql[at + 1] == end;
    if (!is_doubled) return sql.substr(0, at + 1);
    ++at;
  }
  return {};
}

std::string_view while_true(std::string_view sql, bool (*holds)(char)) {
  const auto end = std::ranges::find_if_not(sql, holds);
  return sql.substr(0, static_cast<std::size_t>(end - sql.begin()));
}

bool is_of_number(char letter) { return is_of_name(letter) || letter == '.'; }

/// The text without its quotes; a doubled quote inside means one.
std::string unquoted(std::string_view text) {
  const char end = text.front() == '[' ? ']' : text.front();
  std::string result;
  for (std::size_t at = 1; at + 1 < text.size(); ++at) {
    result += lower(text[at]);
    if (text[at] == end) ++at;
  }
  return result;
}

/// Removes the first token from the text, which must not begin with a space.
Token take_token(std::string_view& sql) {
  const char first = sql.front();
  const auto taken = [&sql](std::size_t size) {
    const std::string_view text = sql.substr(0, size);
    sql.remove_prefix(size);
    return text;
  };
  if (first == '\'' || first == '"' || first == '`' || first == '[') {
    const std::string_view text = quoted_at_front(sql);
    if (text.empty()) return {TokenKind::kSymbol, std::string(taken(sql.size()))};
    if (first == '\'') return {TokenKind::kString, std::string(taken(text.size()))};
    return {TokenKind::kQuoted, unquoted(taken(text.size()))};
  }
  if (is_digit(first))
    return {TokenKind::kNumber, lower_case(taken(while_true(sql, is_of_number).size()))};
  if (is_of_name(first))
    return {TokenKind::kWord, lower_case(taken(while_true(sql, is_of_name).size()))};
  return {TokenKind::kSymbol, std::string(taken(1))};
}

Tokens tokens_of(std::string_view sql) {
  Tokens tokens;
  while (true) {
    sql.remove_prefix(while_true(sql, is_space).size());
    if (sql.empty()) return tokens;
    tokens.push_back(take_token(sql));
  }
}

bool is_keyword(const std::string& word) {
  return sqlite3_keyword_check(word.data(), static_cast<int>(word.size())) != 0;
}

bool is_plain_name(const Token& token) {
  return token.kind == TokenKind::kWord && !is_keyword(token.text);
}

/// A quoted name equals a bare one, but "NOT" is a name and NOT is a keyword.
bool is_same_token(const Token& ours, const Token& theirs) {
  if (ours.text != theirs.text) return false;
  if (ours.kind == theirs.kind) return true;
  return (is_plain_name(ours) && theirs.kind == TokenKind::kQuoted) ||
         (ours.kind == TokenKind::kQuoted && is_plain_name(theirs));
}

bool is_word(const Token& token, std::string_view word) {
  return token.kind == TokenKind::kWord && token.text == word;
}

bool is_symbol(const Token& token, std::string_view symbol) {
  return token.kind == TokenKind::kSymbol && token.text == symbol;
}

/// Reads the columns after a table's own ones, token by token.
class ColumnReader {
 public:
  ColumnReader(const Tokens& tokens, std::size_t at) : tokens_(tokens), at_(at) {}

  /// Reads columns, each after a comma, and the parenthesis that ends the table.
  bool reads_columns_to_the_end() {
    while (takes_symbol(",")) {
      if (!takes_name()) return false;
      takes_type();
      if (!takes_constraints()) return false;
    }
    return takes_symbol(")") && at_ == tokens_.size();
  }

 private:
  const Token& next() const {
    static const Token kNone;
    return at_ < tokens_.size() ? tokens_[at_] : kNone;
  }
  bool takes_if(bool holds) {
    if (holds) ++at_;
    return holds;
  }
  bool takes_symbol(std::string_view symbol) { return takes_if(is_symbol(next(), symbol)); }
  bool takes_word(std::string_view word) { return takes_if(is_word(next(), word)); }
  bool takes_name() { return takes_if(is_plain_name(next()) || next().kind == TokenKind::kQuoted); }
  bool takes_number() { return takes_if(next().kind == TokenKind::kNumber); }

  /// Reads a type: TEXT, DOUBLE PRECISION, TEXT(20), NUMERIC(8, 2), or none.
  void takes_type() {
    while (takes_if(is_plain_name(next()))) {
    }
    const std::size_t begin = at_;
    if (!takes_symbol("(")) return;
    const bool is_size = takes_number() && (!takes_symbol(",") || takes_number());
    if (!is_size || !takes_symbol(")")) at_ = begin;
  }
  bool takes_constant() {
    if (takes_symbol("-") || takes_symbol("+")) return takes_number();
    return takes_number() || takes_if(next().kind == TokenKind::kString) || takes_word("null") ||
           takes_word("true") || takes_word("false");
  }
  bool takes_constraints() {
    while (true) {
      if (takes_word("not")) {
        if (!takes_word("null")) return false;
      } else if (takes_word("default")) {
        if (!takes_constant()) return false;
      } else if (!takes_word("null")) {
        return true;
      }
    }
  }

  const Tokens& tokens_;
  std::size_t at_;
};

}  // namespace

bool is_same_sql(std::string_view ours, std::string_view theirs) {
  return std::ranges::equal(tokens_of(ours), tokens_of(theirs), is_same_token);
}

bool adds_plain_columns(std::string_view ours, std::string_view theirs) {
  const Tokens own = tokens_of(ours);
  const Tokens other = tokens_of(theirs);
  // Compare all of ours except the closing parenthesis.
  if (own.empty() || !is_symbol(own.back(), ")") || other.size() <= own.size()) return false;
  const std::size_t shared = own.size() - 1;
  for (std::size_t i = 0; i < shared; ++i)
    if (!is_same_token(own[i], other[i])) return false;
  return ColumnReader(other, shared).reads_columns_to_the_end();
}

bool is_geopackage_index(std::string_view sql) {
  static const Tokens kIndex =
      tokens_of("CREATE VIRTUAL TABLE name USING rtree(id, minx, maxx, miny, maxy)");
  constexpr std::size_t kName = 3;
  Tokens tokens = tokens_of(sql);
  if (tokens.size() != kIndex.size()) return false;
  tokens[kName] = kIndex[kName];
  return std::ranges::equal(kIndex, tokens, is_same_token);
}

bool is_virtual_table(std::string_view sql) {
  const Tokens tokens = tokens_of(sql);
  return tokens.size() > 1 && is_word(tokens[0], "create") && is_word(tokens[1], "virtual");
}

}  // namespace understory::map_file
