// The session extension's functions need this macro.
#ifndef SQLITE_ENABLE_SESSION
#define SQLITE_ENABLE_SESSION
#endif
#ifndef SQLITE_ENABLE_PREUPDATE_HOOK
#define SQLITE_ENABLE_PREUPDATE_HOOK
#endif
#include "common/map_file/history.hpp"

#include <fmt/format.h>
#include <sqlite3.h>
#include <zlib.h>

#include <algorithm>
#include <limits>
#include <new>

#include "common/map_file/digest.hpp"
#include "common/map_file/schema.hpp"
#include "common/map_file/sql_text.hpp"
#include "common/map_file/submap_tables.hpp"

namespace understory::map_file {
namespace {

/// zlib packs at most this many bytes into one; a larger stated length is damage.
constexpr std::uint64_t kMostPacked = 1040;
constexpr const char* kMain = "main";

struct SqliteFree {
  void operator()(void* memory) const { sqlite3_free(memory); }
};

/// Bytes that SQLite allocated.
struct Changeset {
  std::unique_ptr<void, SqliteFree> bytes;
  int size = 0;
};

void require_ok(const Connection& connection, int result) {
  if (result == SQLITE_NOMEM) throw std::bad_alloc();
  if (result != SQLITE_OK)
    connection.damaged(fmt::format("a change cannot be read ({})", sqlite3_errstr(result)));
}

std::vector<std::uint8_t> packed(const Changeset& changeset) {
  uLongf size = ::compressBound(static_cast<uLong>(changeset.size));
  std::vector<std::uint8_t> bytes(size);
  const auto* const from = static_cast<const Bytef*>(changeset.bytes.get());
  static constexpr Bytef kNone = 0;
  if (::compress2(bytes.data(), &size, from != nullptr ? from : &kNone,
                  static_cast<uLong>(changeset.size), Z_BEST_SPEED) != Z_OK)
    throw std::bad_alloc();
  bytes.resize(size);
  return bytes;
}

/// Unpacks bytes. Fault::kDamaged where the result has not `size` bytes.
std::vector<std::uint8_t> unpacked(const Connection& connection, Blob bytes, std::uint64_t size) {
  const std::uint64_t most =
      std::min<std::uint64_t>(kMostPacked * (bytes.size() + 1), std::numeric_limits<int>::max());
  uLongf length = size;
  std::vector<std::uint8_t> result(size <= most ? size + 1 : 0);
  if (size > most || ::uncompress(result.data(), &length, bytes.data(), bytes.size()) != Z_OK ||
      length != size)
    connection.damaged("a change in the history cannot be unpacked");
  result.resize(size);
  return result;
}

std::string digest_of(std::uint64_t number, const ChangeNote& note, Blob bytes,
                      std::uint64_t size) {
  Digest digest;
  digest.add(static_cast<std::int64_t>(number));
  digest.add(std::int64_t{note.utime});
  digest.add(note.command);
  digest.add(note.source);
  digest.add(note.text);
  digest.add(bytes);
  digest.add(static_cast<std::int64_t>(size));
  return digest.take();
}

constexpr std::string_view kSelectChanges =
    "SELECT number, utime, command, source, text, changeset, changeset_bytes, checksum "
    "FROM understory_history ";

Change change_in(const Statement& row) {
  return {
      row.count(0), {row.integer(1), row.text(2), row.text(3), row.text(4)}, row.blob(5).size()};
}

bool is_as_written(const Statement& row) {
  const Change change = change_in(row);
  return digest_of(change.number, change.note, row.blob(5), row.count(6)) == row.text(7);
}

bool is_content(std::string_view table) {
  return std::ranges::find(kContentTables, table) != kContentTables.end();
}

/// Filter of the tables to which a change is applied.
using TableFilter = int (*)(void* context, const char* table);
int is_content_table(void* /*context*/, const char* table) { return is_content(table) ? 1 : 0; }
/// Tables of other programs are never changed, whatever a change lists.
int is_recorded_table(void* /*context*/, const char* table) {
  const bool is_placement = std::ranges::find(kPlacementTables, table) != kPlacementTables.end();
  return is_placement || is_content(table) ? 1 : 0;
}

/// The rows must equal the result of the change.
int on_conflict(void* /*context*/, int /*kind*/, sqlite3_changeset_iter* /*change*/) {
  return SQLITE_CHANGESET_ABORT;
}

Changeset inverted(const Connection& connection, std::vector<std::uint8_t> bytes) {
  Changeset inverse;
  void* out = nullptr;
  const int result =
      sqlite3changeset_invert(static_cast<int>(bytes.size()), bytes.data(), &inverse.size, &out);
  inverse.bytes.reset(out);
  require_ok(connection, result);
  return inverse;
}

void apply(const Connection& connection, void* changeset, int size, std::uint64_t number,
           TableFilter is_wanted) {
  const int result =
      sqlite3changeset_apply(connection.handle(), size, changeset, is_wanted, on_conflict, nullptr);
  if (result == SQLITE_OK) return;
  if (result == SQLITE_ABORT)
    connection.damaged(fmt::format("the rows are not those that change {} goes with", number));
  connection.fail();
}

/// The change set in a row of kSelectChanges. Fault::kDamaged where it is damaged.
std::vector<std::uint8_t> changeset_in(const Connection& connection, const Statement& row) {
  if (!is_as_written(row))
    connection.damaged(fmt::format("change {} is not what was recorded", row.count(0)));
  return unpacked(connection, row.blob(5), row.count(6));
}

}  // namespace

void SessionCloser::operator()(sqlite3_session* session) const { sqlite3session_delete(session); }

Recording::Recording(const Connection& connection) : connection_(connection) {
  sqlite3_session* session = nullptr;
  require_ok(connection, sqlite3session_create(connection.handle(), kMain, &session));
  session_.reset(session);
  for (const std::string_view table : kContentTables)
    require_ok(connection, sqlite3session_attach(session, std::string(table).c_str()));
  for (const std::string_view table : kPlacementTables)
    require_ok(connection, sqlite3session_attach(session, std::string(table).c_str()));
}

void Recording::add_difference(const std::string& schema) {
  for (const std::string_view table : kContentTables) {
    char* message = nullptr;
    const int result =
        sqlite3session_diff(session_.get(), schema.c_str(), std::string(table).c_str(), &message);
    const std::unique_ptr<char, SqliteFree> released(message);
    if (result == SQLITE_SCHEMA)
      connection_.damaged(fmt::format("{}: its definition was changed", table));
    require_ok(connection_, result);
  }
}

std::uint64_t Recording::write(const ChangeNote& note) {
  Changeset changeset;
  void* out = nullptr;
  const int result = sqlite3session_changeset(session_.get(), &changeset.size, &out);
  changeset.bytes.reset(out);
  require_ok(connection_, result);

  const std::uint64_t number = latest_change(connection_) + 1;
  const auto size = static_cast<std::uint64_t>(changeset.size);
  const std::vector<std::uint8_t> bytes = packed(changeset);
  const std::string checksum = digest_of(number, note, bytes, size);
  connection_.prepare("INSERT INTO understory_history VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)")
      .bind(static_cast<std::int64_t>(number), std::int64_t{note.utime},
            std::string_view(note.command), std::string_view(note.source),
            std::string_view(note.text), Blob(bytes), static_cast<std::int64_t>(size),
            std::string_view(checksum))
      .run();
  state_program(connection_);
  return number;
}

std::uint64_t latest_change(const Connection& connection) {
  const std::int64_t number =
      connection.number("SELECT coalesce(max(number), 0) FROM understory_history");
  if (number < 0) connection.damaged("a change has a negative number");
  return static_cast<std::uint64_t>(number);
}

std::vector<Change> changes_in(const Connection& connection) {
  std::vector<Change> changes;
  Statement row = connection.prepare(std::string(kSelectChanges) + "ORDER BY number");
  while (row.step()) changes.push_back(change_in(row));
  return changes;
}

void undo(const Connection& connection, std::uint64_t number) {
  Changeset inverse;
  {
    Statement row = connection.prepare(std::string(kSelectChanges) + "WHERE number = ?1");
    if (!row.bind(static_cast<std::int64_t>(number)).step())
      connection.damaged(fmt::format("change {} is missing", number));
    inverse = inverted(connection, changeset_in(connection, row));
  }
  apply(connection, inverse.bytes.get(), inverse.size, number, is_recorded_table);
}

std::unique_ptr<Connection> recorded_content(const Connection& connection) {
  auto recorded = std::make_unique<Connection>(connection.file());
  Statement made =
      connection.prepare("SELECT sql FROM sqlite_schema WHERE type = 'table' AND name = ?1");
  for (const SchemaObject& object : schema_objects()) {
    if (!is_content(object.name)) continue;
    // Later changes include the columns added by another program.
    const bool is_there = made.bind(std::string_view(object.name)).step();
    const std::string theirs = is_there ? made.text(0) : std::string();
    recorded->execute(adds_plain_columns(object.sql, theirs) ? theirs : object.sql);
  }

  Statement row = connection.prepare(std::string(kSelectChanges) + "ORDER BY number");
  while (row.step()) {
    std::vector<std::uint8_t> changeset = changeset_in(connection, row);
    apply(*recorded, changeset.data(), static_cast<int>(changeset.size()), row.count(0),
          is_content_table);
  }
  return recorded;
}

std::vector<std::string> faults_of_history(const Connection& connection) {
  std::vector<std::string> faults;
  std::uint64_t expected = 1;
  Statement row = connection.prepare(std::string(kSelectChanges) + "ORDER BY number");
  while (row.step()) {
    const std::uint64_t number = row.count(0);
    if (number != expected)
      faults.push_back(
          fmt::format("history: change {} stands where {} is expected", number, expected));
    if (!is_as_written(row))
      faults.push_back(fmt::format("history: change {} is not what was recorded", number));
    expected = number + 1;
  }
  return faults;
}

}  // namespace understory::map_file
