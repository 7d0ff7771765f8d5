#include "common/map_file/foreign_edits.hpp"

#include <sqlite3.h>

#include <new>

#include "common/map_file/existence_rows.hpp"
#include "common/map_file/map_rows.hpp"
#include "common/map_file/reference_rows.hpp"
#include "common/map_file/schema.hpp"

namespace understory::map_file {
namespace {

constexpr const char* kRecorded = "recorded";

/// Attaches a copy of an in-memory database to the file's connection during its lifetime.
class Attached {
 public:
  Attached(const Connection& connection, const Connection& other) : connection_(connection) {
    connection_.execute(std::string("ATTACH ':memory:' AS ") + kRecorded);
    sqlite3_int64 size = 0;
    unsigned char* const bytes = sqlite3_serialize(other.handle(), "main", &size, 0);
    if (bytes == nullptr) throw std::bad_alloc();
    // SQLite owns the bytes from here on, also on failure.
    const int result = sqlite3_deserialize(connection_.handle(), kRecorded, bytes, size, size,
                                           SQLITE_DESERIALIZE_FREEONCLOSE);
    if (result != SQLITE_OK) connection_.fail();
  }
  ~Attached() { sqlite3_exec(connection_.handle(), "DETACH recorded", nullptr, nullptr, nullptr); }
  Attached(const Attached&) = delete;
  Attached& operator=(const Attached&) = delete;

 private:
  const Connection& connection_;
};

bool is_readable(const Connection& connection, std::uint32_t map_id, bool must_be_map) {
  try {
    select_map(connection, map_id);
    return true;
  } catch (const MapFileError&) {
    if (must_be_map) throw;
    return false;
  }
}

void renew_checksums(const Connection& connection, bool must_be_maps) {
  for (const std::uint32_t id : map_ids(connection)) {
    if (is_readable(connection, id, must_be_maps)) state_checksum(connection, id);
  }
}

}  // namespace

bool is_as_recorded(const Connection& connection, const Connection& recorded) {
  const std::vector<std::uint32_t> ids = map_ids(connection);
  if (ids != map_ids(recorded)) return false;
  if (select_reference(connection) != select_reference(recorded)) return false;
  for (const std::uint32_t id : ids) {
    const std::string checksum = checksum_of(connection, id);
    if (checksum != checksum_of(recorded, id) || checksum != stated_checksum(connection, id))
      return false;
  }
  return true;
}

std::uint64_t record_foreign_edits(const Connection& connection, const Connection& recorded,
                                   const ChangeNote& note, bool must_be_maps) {
  const Attached attached(connection, recorded);
  Transaction transaction(connection);
  // Programs that delete a landmark do not delete its state.
  drop_lost_states(connection);
  std::uint64_t number = 0;
  {
    Recording recording(connection);
    recording.add_difference(kRecorded);
    renew_checksums(connection, must_be_maps);
    number = recording.write(note);
  }
  refresh_contents(connection, note.utime);
  transaction.commit();
  return number;
}

}  // namespace understory::map_file
