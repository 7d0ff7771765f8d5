// Wrapper of SQLite for this folder: one open file, and statements on it.
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

/// Access to an open file.
enum class Access { kRead, kWrite };

/// Bytes of a column; valid until the next step().
using Blob = std::span<const std::uint8_t>;

/// Deleter of statements.
struct StatementCloser {
  /// Ends a statement; its errors were reported by step().
  void operator()(sqlite3_stmt* statement) const;
};
/// Deleter of connections.
struct ConnectionCloser {
  /// Closes a file; its statements must be destroyed before.
  void operator()(sqlite3* connection) const;
};

class Connection;

/// One SQL statement. Errors are thrown as MapFileError, which begins with the file.
class Statement {
 public:
  /// Called by Connection::prepare.
  Statement(const Connection& connection, sqlite3_stmt* statement)
      : connection_(&connection), statement_(statement) {}

  /// Sets the values ?1, ?2, ... and restarts the statement: std::int64_t, double,
  /// std::string_view, Blob, or an optional of one of them (none = NULL). Texts and bytes must live
  /// until the last step.
  template <class... Values>
  Statement& bind(const Values&... values) {
    restart();
    int index = 0;
    (put(++index, values), ...);
    return *this;
  }
  /// Moves to the next row; false = no more rows.
  bool step();
  /// Runs a statement without result rows.
  void run() {
    while (step()) {
    }
  }

  /// Whether the column of the row is NULL. Columns are numbered from 0.
  bool is_null(int column) const;
  /// A whole number. Fault::kDamaged where the column has another type.
  std::int64_t integer(int column) const;
  /// The same for a number that must not be negative.
  std::uint64_t count(int column) const;
  /// A number. Fault::kDamaged where the column has another type.
  double real(int column) const;
  /// A text; NULL is empty. Fault::kDamaged where the column has another type.
  std::string text(int column) const;
  /// Bytes. Fault::kDamaged where the column has another type.
  Blob blob(int column) const;
  /// SQLite's statement, for functions not covered here.
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

/// An open database. Not movable, because statements refer to it.
class Connection {
 public:
  /// Opens the existing file `place`, named `file` in errors; reads nothing yet. The schema is not
  /// trusted, and statements that would run foreign triggers or views fail (schema_guard.hpp).
  /// Throws MapFileError.
  Connection(const std::filesystem::path& place, Access access, std::filesystem::path file);
  /// An empty database in memory. Throws MapFileError.
  explicit Connection(std::filesystem::path file);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Prepares a statement.
  Statement prepare(std::string_view sql) const;
  /// Runs statements without results.
  void execute(const std::string& sql) const;
  /// First column of the first row, a whole number.
  std::int64_t number(std::string_view sql) const;
  /// First column of the first row; empty where there is no row.
  std::string text(std::string_view sql) const;

  /// Sets whether triggers of the schema may access virtual tables, as those of the layers do; only
  /// for a schema that is entirely ours.
  void trust_schema(bool is_trusted) const;
  /// Latest value of trust_schema().
  bool is_schema_trusted() const;

  /// The file's name for people.
  const std::filesystem::path& file() const { return file_; }
  /// SQLite's connection, for functions not covered here.
  sqlite3* handle() const { return handle_.get(); }
  /// Throws the fault of SQLite's last error.
  [[noreturn]] void fail() const;
  /// Throws Fault::kDamaged with this text.
  [[noreturn]] void damaged(const std::string& what) const;

 private:
  void open(const std::string& path, int flags);

  std::filesystem::path file_;
  std::unique_ptr<sqlite3, ConnectionCloser> handle_;
};

/// BEGIN IMMEDIATE; rolled back unless committed.
class Transaction {
 public:
  /// Begins. Throws MapFileError where another process is writing.
  explicit Transaction(const Connection& connection);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  /// On return the transaction is in the file and on the device.
  void commit();

 private:
  const Connection& connection_;
  bool is_open_ = true;
};

}  // namespace understory::map_file
