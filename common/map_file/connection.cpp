#include "common/map_file/connection.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>

#include "common/map_file/geometry_functions.hpp"
#include "common/map_file/schema_guard.hpp"

namespace understory::map_file {
namespace {

bool has_no_room(int system_error) {
  return system_error == ENOSPC || system_error == EDQUOT || system_error == EFBIG;
}

struct Diagnosis {
  Fault fault;
  std::string text;
};

Diagnosis diagnosis_of(int code, int system_error, const std::string& message) {
  switch (code) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return {Fault::kInUse, "another process has it open"};
    case SQLITE_READONLY:
      return {Fault::kReadOnly, "it, or its folder, cannot be written"};
    case SQLITE_FULL:
      return {Fault::kFull, "no room left on the device; nothing was changed"};
    case SQLITE_IOERR:
      if (has_no_room(system_error))
        return {Fault::kFull, fmt::format("no room for it; nothing was changed ({})",
                                          std::strerror(system_error))};
      return {Fault::kUnreadable,
              fmt::format("the device failed ({}, {})", message, std::strerror(system_error))};
    case SQLITE_CORRUPT:
      return {Fault::kDamaged, fmt::format("damaged ({})", message)};
    case SQLITE_NOTADB:
      return {Fault::kForeign, "no map file: it is no GeoPackage"};
    case SQLITE_CANTOPEN:
      return {Fault::kUnreadable,
              fmt::format("cannot be opened ({})",
                          system_error != 0 ? std::strerror(system_error) : message)};
    case SQLITE_AUTH:
      return {Fault::kUntrusted, "a trigger or a view in it that is not ours would run"};
    case SQLITE_CONSTRAINT:
      return {Fault::kRefused, fmt::format("does not take this change ({})", message)};
    default:
      return {Fault::kDamaged, fmt::format("not as this version writes it ({})", message)};
  }
}

/// Limits from sqlite.org/security.html for foreign files; our statements need no more.
void set_limits(sqlite3* handle) {
  sqlite3_limit(handle, SQLITE_LIMIT_SQL_LENGTH, 1'000'000);
  sqlite3_limit(handle, SQLITE_LIMIT_EXPR_DEPTH, 100);
  sqlite3_limit(handle, SQLITE_LIMIT_COMPOUND_SELECT, 20);
  sqlite3_limit(handle, SQLITE_LIMIT_VDBE_OP, 250'000);
  sqlite3_limit(handle, SQLITE_LIMIT_ATTACHED, 1);
  sqlite3_limit(handle, SQLITE_LIMIT_LIKE_PATTERN_LENGTH, 100);
  sqlite3_limit(handle, SQLITE_LIMIT_TRIGGER_DEPTH, 10);
  sqlite3_limit(handle, SQLITE_LIMIT_WORKER_THREADS, 0);
}

void set_up(sqlite3* handle) {
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, 0);
  int ignored = 0;
  sqlite3_db_config(handle, SQLITE_DBCONFIG_DEFENSIVE, 1, &ignored);
  // SQLite 3.40 lets triggers access the R*Tree only if the schema is trusted; it is trusted after
  // its check.
  sqlite3_db_config(handle, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, &ignored);
  sqlite3_exec(handle, "PRAGMA cell_size_check = ON; PRAGMA mmap_size = 0", nullptr, nullptr,
               nullptr);
  set_limits(handle);
  deny_foreign_sql(handle);
}

}  // namespace

void StatementCloser::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

void ConnectionCloser::operator()(sqlite3* connection) const { sqlite3_close(connection); }

void Statement::restart() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

bool Statement::step() {
  const int result = sqlite3_step(statement_.get());
  if (result != SQLITE_ROW && result != SQLITE_DONE) connection_->fail();
  return result == SQLITE_ROW;
}

bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

void Statement::wrong_type(int column, std::string_view wanted) const {
  connection_->damaged(
      fmt::format("column {} is no {}", sqlite3_column_name(statement_.get(), column), wanted));
}

std::int64_t Statement::integer(int column) const {
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_INTEGER)
    wrong_type(column, "whole number");
  return sqlite3_column_int64(statement_.get(), column);
}

std::uint64_t Statement::count(int column) const {
  const std::int64_t value = integer(column);
  if (value < 0) wrong_type(column, "number from 0 up");
  return static_cast<std::uint64_t>(value);
}

double Statement::real(int column) const {
  const int type = sqlite3_column_type(statement_.get(), column);
  if (type != SQLITE_FLOAT && type != SQLITE_INTEGER) wrong_type(column, "number");
  return sqlite3_column_double(statement_.get(), column);
}

std::string Statement::text(int column) const {
  if (is_null(column)) return {};
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_TEXT) wrong_type(column, "text");
  const auto* const text =
      reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  return {text, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

Blob Statement::blob(int column) const {
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_BLOB) wrong_type(column, "blob");
  const auto* const bytes =
      static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  return {bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

void Statement::put(int index, std::int64_t value) {
  if (sqlite3_bind_int64(statement_.get(), index, value) != SQLITE_OK) connection_->fail();
}

void Statement::put(int index, double value) {
  if (sqlite3_bind_double(statement_.get(), index, value) != SQLITE_OK) connection_->fail();
}

void Statement::put(int index, std::string_view value) {
  const char* const text = value.empty() ? "" : value.data();
  if (sqlite3_bind_text64(statement_.get(), index, text, value.size(), SQLITE_STATIC,
                          SQLITE_UTF8) != SQLITE_OK)
    connection_->fail();
}

void Statement::put(int index, Blob value) {
  static constexpr std::uint8_t kNothing = 0;
  const void* const bytes = value.empty() ? &kNothing : value.data();
  if (sqlite3_bind_blob64(statement_.get(), index, bytes, value.size(), SQLITE_STATIC) != SQLITE_OK)
    connection_->fail();
}

void Statement::put(int index, std::nullopt_t /*nothing*/) {
  if (sqlite3_bind_null(statement_.get(), index) != SQLITE_OK) connection_->fail();
}

Connection::Connection(const std::filesystem::path& place, Access access,
                       std::filesystem::path file)
    : file_(std::move(file)) {
  // An absolute path: SQLite would treat a name that begins with "file:" as a URI.
  open(std::filesystem::absolute(place).string(),
       access == Access::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE);
  set_up(handle_.get());
}

Connection::Connection(std::filesystem::path file) : file_(std::move(file)) {
  open(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
}

void Connection::open(const std::string& path, int flags) {
  sqlite3* handle = nullptr;
  const int result = sqlite3_open_v2(path.c_str(), &handle, flags, nullptr);
  handle_.reset(handle);
  if (handle == nullptr) throw std::bad_alloc();
  if (result != SQLITE_OK) fail();
  register_geometry_functions(handle);
}

Statement Connection::prepare(std::string_view sql) const {
  sqlite3_stmt* statement = nullptr;
  const int result = sqlite3_prepare_v2(handle_.get(), sql.data(), static_cast<int>(sql.size()),
                                        &statement, nullptr);
  if (result != SQLITE_OK) fail();
  return {*this, statement};
}

void Connection::execute(const std::string& sql) const {
  if (sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

std::int64_t Connection::number(std::string_view sql) const {
  Statement statement = prepare(sql);
  if (!statement.step()) damaged("a row is missing");
  return statement.integer(0);
}

std::string Connection::text(std::string_view sql) const {
  Statement statement = prepare(sql);
  return statement.step() ? statement.text(0) : std::string();
}

void Connection::trust_schema(bool is_trusted) const {
  int ignored = 0;
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, is_trusted ? 1 : 0, &ignored);
}

bool Connection::is_schema_trusted() const {
  int is_trusted = 0;
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, -1, &is_trusted);
  return is_trusted != 0;
}

void Connection::fail() const {
  // The low byte of an extended code is the kind.
  const int code = sqlite3_extended_errcode(handle_.get()) & 0xFF;
  if (code == SQLITE_NOMEM) throw std::bad_alloc();
  // The SQL of a damaged schema contains line feeds.
  std::string message = sqlite3_errmsg(handle_.get());
  std::ranges::replace(message, '\n', ' ');
  const Diagnosis found = diagnosis_of(code, sqlite3_system_errno(handle_.get()), message);
  throw MapFileError(found.fault, fmt::format("{}: {}", file_.string(), found.text));
}

void Connection::damaged(const std::string& what) const {
  throw MapFileError(Fault::kDamaged, fmt::format("{}: damaged: {}", file_.string(), what));
}

Transaction::Transaction(const Connection& connection) : connection_(connection) {
  connection_.execute("BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  // A full disk may have rolled it back already: then there is nothing to do.
  if (is_open_) sqlite3_exec(connection_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  connection_.execute("COMMIT");
  is_open_ = false;
}

}  // namespace understory::map_file
