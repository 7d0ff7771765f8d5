// What was changed in a map file: each change with the rows as they were before.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/map_file/connection.hpp"
#include "common/model/map.hpp"

struct sqlite3_session;

namespace understory::map_file {

/// Why a change is made; all texts for people.
struct ChangeNote {
  model::Utime utime = 0;  ///< When [us since the epoch].
  std::string command;     ///< What made it, e.g. "understory map import".
  std::string source;      ///< What it was made from, e.g. a file's name.
  std::string text;        ///< What it does.
};

/// One change of a file.
struct Change {
  std::uint64_t number = 0;  ///< From 1, without holes.
  ChangeNote note;
  std::uint64_t bytes = 0;  ///< Of its rows before and after, as they are in the file.
};

/// Releases what SQLite gave.
struct SessionCloser {
  /// Ends a session.
  void operator()(sqlite3_session* session) const;
};

/// Records what is changed in the content tables, and of where submaps are (submap_tables.hpp),
/// from its making on, by SQLite's session extension.
class Recording {
 public:
  /// Begins. The connection's transaction has begun and outlives it.
  explicit Recording(const Connection& connection);
  /// Takes as changed what makes the content tables of the attached database `schema` those of the
  /// file. Nothing was changed yet. Fault::kDamaged where tables have not the same columns.
  void add_difference(const std::string& schema);
  /// Writes the change into the history and gives its number. A change of nothing is one, too.
  std::uint64_t write(const ChangeNote& note);

 private:
  const Connection& connection_;
  std::unique_ptr<sqlite3_session, SessionCloser> session_;
};

/// Number of the latest change; 0 = none.
std::uint64_t latest_change(const Connection& connection);
/// All changes, in order of number.
std::vector<Change> changes_in(const Connection& connection);
/// Takes one change back: its rows become what they were before it, where submaps are among them.
/// All later ones must have been taken back. Fault::kDamaged where the rows are not what the change
/// left, or the change is not what was recorded; the transaction is then to be rolled back.
void undo(const Connection& connection, std::uint64_t number);
/// The content tables as the history says that they are, in memory: all changes, one after the
/// other. Fault::kDamaged where a change is not what was recorded. O(all changes).
std::unique_ptr<Connection> recorded_content(const Connection& connection);
/// What is wrong with the record of the changes: numbers missing, one that is not what was written.
std::vector<std::string> faults_of_history(const Connection& connection);

}  // namespace understory::map_file
