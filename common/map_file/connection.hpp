// SQLite as far as this folder uses it: one open file, and statements on it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/map_file/map_file_error.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace understory::map_file {

/// What a file is opened for.
enum class Access { kRead, kWrite };

/// Bytes of a column; they live until the statement steps on.
using Blob = std::span<const std::uint8_t>;

/// Releases what SQLite gave.
struct StatementCloser {
  /// Ends a statement; its errors were reported by step().
  void operator()(sqlite3_stmt* statement) const;
};
/// Releases what SQLite gave.
struct ConnectionCloser {
  /// Closes a file; statements on it must be gone.
  void operator()(sqlite3* connection) const;
};

class Connection;

/// One SQL statement. All errors are MapFileError, with the file in front.
class Statement {
 public:
  /// For Connection::prepare.
  Statement(const Connection& connection, sqlite3_stmt* statement)
      : connection_(&connection), statement_(statement) {}

  /// Values for ?1, ?2, ..., of a statement that then starts anew: std::int64_t, double,
  /// std::string_view, Blob, or an optional of one of them (none = NULL). Texts and bytes must live
  /// until the last step.
  template <class... Values>
  Statement& bind(const Values&... values) {
    restart();
    int index = 0;
    (put(++index, values), ...);
    return *this;
  }
  /// On to the next row; false = there is none.
  bool step();
  /// To the end, for statements that give no rows.
  void run() {
    while (step()) {
    }
  }

  /// Whether the column of the row is NULL. Columns count from 0.
  bool is_null(int column) const;
  /// A whole number. Fault::kDamaged where the column has something else.
  std::int64_t integer(int column) const;
  /// The same, which must not be negative.
  std::uint64_t count(int column) const;
  /// A number. Fault::kDamaged where the column has something else.
  double real(int column) const;
  /// A text; NULL is empty. Fault::kDamaged where the column has something else.
  std::string text(int column) const;
  /// Bytes. Fault::kDamaged where the column has something else.
  Blob blob(int column) const;
  /// SQLite's statement, for what is not covered here.
  sqlite3_stmt* handle() const { return statement_.get(); }

 private:
  void restart();
  void put(int index, std::int64_t value);
  void put(int index, double value);
  void put(int index, std::string_view value);
  void put(int index, Blob value);
  void put(int index, std::nullopt_t);
  template <class T>
  void put(int index, const std::optional<T>& value) {
    value ? put(index, *value) : put(index, std::nullopt);
  }
  [[noreturn]] void wrong_type(int column, std::string_view wanted) const;

  const Connection* connection_;
  std::unique_ptr<sqlite3_stmt, StatementCloser> statement_;
};

/// An open database. Statements refer to it: it stays where it is.
class Connection {
 public:
  /// Opens the existing file `place`, which errors call `file`; nothing is read yet. The schema is
  /// not trusted, and statements in which triggers or views of others would run fail
  /// (schema_guard.hpp). Throws MapFileError.
  Connection(const std::filesystem::path& place, Access access, std::filesystem::path file);
  /// An empty database in memory. Throws MapFileError.
  explicit Connection(std::filesystem::path file);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// A statement from SQL.
  Statement prepare(std::string_view sql) const;
  /// Runs statements that give nothing.
  void execute(const std::string& sql) const;
  /// First column of the first row, a whole number.
  std::int64_t number(std::string_view sql) const;
  /// First column of the first row; empty where there is no row.
  std::string text(std::string_view sql) const;

  /// Whether triggers of the schema reach virtual tables, as those of the layers do; for a schema
  /// that is ours only.
  void trust_schema(bool is_trusted) const;
  /// As trust_schema() was called last.
  bool is_schema_trusted() const;

  /// The file's name for people.
  const std::filesystem::path& file() const { return file_; }
  /// SQLite's connection, for what is not covered here.
  sqlite3* handle() const { return handle_.get(); }
  /// Throws the fault that SQLite's last error is.
  [[noreturn]] void fail() const;
  /// Throws Fault::kDamaged with what is wrong.
  [[noreturn]] void damaged(const std::string& what) const;

 private:
  void open(const std::string& path, int flags);

  std::filesystem::path file_;
  std::unique_ptr<sqlite3, ConnectionCloser> handle_;
};

/// BEGIN IMMEDIATE; rolled back unless committed.
class Transaction {
 public:
  /// Begins. Throws MapFileError where others are writing.
  explicit Transaction(const Connection& connection);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  /// All of it is in the file, and on the device, when this returns.
  void commit();

 private:
  const Connection& connection_;
  bool is_open_ = true;
};

}  // namespace understory::map_file
