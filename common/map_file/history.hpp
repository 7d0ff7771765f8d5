// The history of a map file: each change with the old rows.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/model/map.hpp"

struct sqlite3_session;

namespace understory::map_file {

/// Description of a change; all texts are for people.
struct ChangeNote {
  model::Utime utime = 0;  ///< Time of the change [us since the epoch].
  std::string command;     ///< The command, e.g. "understory map import".
  std::string source;      ///< The source, e.g. a file's name.
  std::string text;        ///< The effect of the change.
};

/// One change of a file.
struct Change {
  std::uint64_t number = 0;  ///< From 1, without gaps.
  ChangeNote note;
  std::uint64_t bytes = 0;  ///< Size of its old and new rows in the file.
};

/// Deleter of sessions.
struct SessionCloser {
  /// Ends a session.
  void operator()(sqlite3_session* session) const;
};

/// Records changes of the content tables and of the submaps' places (submap_tables.hpp) during its
/// lifetime, by SQLite's session extension.
class Recording {
 public:
  /// Begins. The connection's transaction must have begun and outlive it.
  explicit Recording(const Connection& connection);
  /// Records the difference from the content tables of the attached database `schema` to those of
  /// the file. Call it before any change. Fault::kDamaged where tables have different columns.
  void add_difference(const std::string& schema);
  /// Writes the change into the history and returns its number. An empty change is recorded too.
  std::uint64_t write(const ChangeNote& note);

 private:
  const Connection& connection_;
  std::unique_ptr<sqlite3_session, SessionCloser> session_;
};

/// Number of the latest change; 0 = none.
std::uint64_t latest_change(const Connection& connection);
/// All changes, in order of number.
std::vector<Change> changes_in(const Connection& connection);
/// Reverts one change: restores its old rows, places of submaps included. All later changes must
/// have been reverted. Fault::kDamaged where the rows differ from the result of the change, or the
/// record is damaged; the caller must then roll back the transaction.
void undo(const Connection& connection, std::uint64_t number);
/// The content tables by the history, in memory: all changes are applied in order. Fault::kDamaged
/// where a record is damaged. O(all changes).
std::unique_ptr<Connection> recorded_content(const Connection& connection);
/// Faults of the recorded changes: missing numbers, damaged records.
std::vector<std::string> faults_of_history(const Connection& connection);

}  // namespace understory::map_file
