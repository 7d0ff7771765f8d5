#include "common/bag/sqlite_bag.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <initializer_list>
#include <map>
#include <new>
#include <span>
#include <string_view>

#include "common/io/data_error.hpp"
#include "common/io/file_window.hpp"

namespace understory::bag {
namespace {

/// A prepared statement.
using Statement = std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)>;

std::string text_at(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text == nullptr ? std::string() : std::string(text);
}

/// Without a log of the writer nothing else is to be read: SQLite then leaves all files alone.
std::string uri_of(const std::filesystem::path& path) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    if (c == '?' || c == '#' || c == '%') {
      uri += fmt::format("%{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      uri += c;
    }
  }

  std::error_code none;
  const auto log = std::filesystem::file_size(path.string() + "-wal", none);
  return uri + (none || log == 0 ? "?immutable=1" : "?mode=ro");
}

/// The command for a file of which only parts can be read.
std::string recovery_of(const std::string& file) {
  return fmt::format("'sqlite3 {} .recover | sqlite3 NEW.db3' saves what is left", file);
}

/// Why SQLite refuses a file, and what helps. `message` is SQLite's own text.
std::string fault_of(const std::string& file, int code, int system_error,
                     const std::string& message) {
  const std::string reason = system_error != 0 ? std::strerror(system_error) : message;
  switch (code) {
    case SQLITE_CORRUPT:
      return fmt::format("damaged ({}): {}", message, recovery_of(file));
    case SQLITE_NOTADB:
      return "damaged or encrypted: its header is not that of an SQLite file";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "a recorder still has it open: stop the recorder first";
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
      return fmt::format(
          "cannot be opened ({}); with {}-wal beside it, its folder must be writable", reason,
          file);
    case SQLITE_IOERR:
      return fmt::format("the device failed ({}, {})", message, reason);
    default:
      return fmt::format("not as rosbag2 writes it ({})", message);
  }
}

std::uint32_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8U | byte;
  return value;
}

/// SQLite reads zeros behind the end of a file that is cut off within a page. Its header tells how
/// many pages there were (https://sqlite.org/fileformat.html, 1.3).
void refuse_cut_off(const std::filesystem::path& path) {
  io::FileWindow file(path);
  std::array<std::uint8_t, 100> header{};
  if (!file.read(0, header)) throw io::DataError(path.string() + ": cut off within its header");
  const std::span<const std::uint8_t> bytes(header);
  const std::uint32_t stated = big_endian(bytes.subspan(16, 2));
  const std::uint64_t page = stated == 1 ? 65536 : stated;
  const bool is_count_valid = std::ranges::equal(bytes.subspan(24, 4), bytes.subspan(92, 4));
  const std::uint64_t pages = is_count_valid ? big_endian(bytes.subspan(28, 4)) : 0;
  if (page == 0 || (file.size() % page == 0 && file.size() >= page * pages)) return;
  throw io::DataError(fmt::format("{}: cut off at byte {}: {}", path.string(), file.size(),
                                  recovery_of(path.string())));
}

}  // namespace

/// The open file and the statements on it.
class SqliteBag::Database {
 public:
  explicit Database(const std::filesystem::path& path) : source_(path.string()) {
    refuse_cut_off(path);
    const int flags = SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX;
    sqlite3* raw = nullptr;
    const int result = sqlite3_open_v2(uri_of(path).c_str(), &raw, flags, nullptr);
    file_.reset(raw);
    if (result != SQLITE_OK) refuse();
    // What a stranger's file holds is data alone.
    sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_exec(raw, "PRAGMA cell_size_check = 1", nullptr, nullptr, nullptr);
  }

  Statement prepare(const std::string& sql) {
    sqlite3_stmt* raw = nullptr;
    const int result = sqlite3_prepare_v2(file_.get(), sql.c_str(), -1, &raw, nullptr);
    Statement statement(raw, sqlite3_finalize);
    if (result != SQLITE_OK) refuse();
    return statement;
  }

  /// False at the end.
  bool step(const Statement& statement) {
    const int result = sqlite3_step(statement.get());
    if (result != SQLITE_ROW && result != SQLITE_DONE) refuse();
    return result == SQLITE_ROW;
  }

  bool has_table(const std::string& name) {
    const Statement statement = prepare(
        fmt::format("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = '{}'", name));
    return step(statement);
  }

  /// Throws io::DataError where a column of the table is missing.
  void require(std::string_view table, std::initializer_list<std::string_view> columns) {
    std::vector<std::string> found;
    const Statement names = prepare(fmt::format("SELECT name FROM pragma_table_info('{}')", table));
    while (step(names)) found.push_back(text_at(names.get(), 0));
    for (const std::string_view column : columns) {
      if (std::ranges::find(found, column) == found.end())
        throw io::DataError(
            fmt::format("{}: no ROS 2 bag: its table {} has no column {}", source_, table, column));
    }
  }

  [[noreturn]] void refuse() {
    // The low byte of an extended code is the kind.
    const int code = sqlite3_extended_errcode(file_.get()) & 0xFF;
    if (code == SQLITE_NOMEM) throw std::bad_alloc();
    // The SQL of a damaged schema comes with its line feeds.
    std::string message = sqlite3_errmsg(file_.get());
    std::ranges::replace(message, '\n', ' ');
    throw io::DataError(fmt::format(
        "{}: {}", source_, fault_of(source_, code, sqlite3_system_errno(file_.get()), message)));
  }

  std::map<std::int64_t, std::size_t> wanted;  ///< Places in topics_ by id in the file.

 private:
  std::string source_;
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> file_{nullptr, sqlite3_close};

 public:
  // Behind the file: they end before it is closed.
  Statement order{nullptr, sqlite3_finalize};    ///< Ids of messages in order of time.
  Statement message{nullptr, sqlite3_finalize};  ///< One message by its id.
};

SqliteBag::SqliteBag(const std::filesystem::path& path)
    : source_(path.string()), database_(std::make_unique<Database>(path)) {
  if (!database_->has_table("topics") || !database_->has_table("messages"))
    throw io::DataError(source_ +
                        ": an SQLite file without the tables topics and messages of a "
                        "ROS 2 bag");
  database_->require("topics", {"id", "name", "type", "serialization_format"});
  database_->require("messages", {"id", "topic_id", "timestamp", "data"});
  std::error_code none;
  const auto journal = std::filesystem::file_size(source_ + "-journal", none);
  if (!none && journal > 0)
    remarks_.push_back(source_ +
                       "-journal: its recorder died while writing: the last messages may "
                       "be damaged");
  list_topics();
  rewind({});
}

SqliteBag::~SqliteBag() = default;

void SqliteBag::list_topics() {
  const Statement rows =
      database_->prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
  while (database_->step(rows)) {
    const std::string encoding = text_at(rows.get(), 3);
    topics_.push_back({text_at(rows.get(), 1), plain_type(text_at(rows.get(), 2)),
                       encoding_of(encoding), encoding, 0});
    ids_.push_back(sqlite3_column_int64(rows.get(), 0));
  }

  const Statement counts =
      database_->prepare("SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id");
  while (database_->step(counts)) {
    const auto id = std::ranges::find(ids_, sqlite3_column_int64(counts.get(), 0));
    if (id == ids_.end()) continue;
    topics_[static_cast<std::size_t>(id - ids_.begin())].messages =
        static_cast<std::uint64_t>(sqlite3_column_int64(counts.get(), 1));
  }
}

void SqliteBag::rewind(const std::vector<std::size_t>& wanted) {
  database_->wanted.clear();
  std::vector<std::int64_t> ids;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (!wanted.empty() && std::ranges::find(wanted, i) == wanted.end()) continue;
    database_->wanted.emplace(ids_[i], i);
    ids.push_back(ids_[i]);
  }

  // Ids first: where the file has no index by time, messages themselves are not sorted.
  database_->order = database_->prepare(fmt::format(
      "SELECT id, timestamp FROM messages WHERE topic_id IN ({}) ORDER BY timestamp, id",
      fmt::join(ids, ",")));
  database_->message =
      database_->prepare("SELECT topic_id, timestamp, data FROM messages WHERE id = ?");
}

std::optional<Message> SqliteBag::next() {
  while (database_->step(database_->order)) {
    sqlite3_stmt* message = database_->message.get();
    sqlite3_reset(message);
    sqlite3_bind_int64(message, 1, sqlite3_column_int64(database_->order.get(), 0));
    if (!database_->step(database_->message)) continue;
    const auto topic = database_->wanted.find(sqlite3_column_int64(message, 0));
    if (topic == database_->wanted.end()) continue;

    const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(message, 2));
    const int size = sqlite3_column_bytes(message, 2);
    if (bytes == nullptr || size <= 0) {
      data_.clear();
    } else {
      data_.assign(bytes, bytes + size);
    }
    return Message{topic->second, bounded_time(sqlite3_column_int64(message, 1)), data_};
  }
  return std::nullopt;
}

}  // namespace understory::bag
